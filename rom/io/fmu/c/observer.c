/* A filter in its steady state: x <- CLOSED x + DRIVEN y over each step of DT, y the samples at its
   begin; the values WANTED x are estimates at its end. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"
#include "tables.h" /* STATES, SENSORS, VALUES, DT, CLOSED, DRIVEN, WANTED, DEVIATIONS */

typedef struct {
    double t, y[SENSORS], x[STATES];
} State;

struct Model {
    State now;
};

Model *model_open(const char *resources, char *message)
{
    Model *m = malloc(sizeof *m);
    (void)resources;
    if (!m)
        snprintf(message, MESSAGE, "no memory for %d states.", STATES);
    else
        model_reset(m, message);
    return m;
}

void model_close(Model *m) { free(m); }

int model_reset(Model *m, char *message)
{
    (void)message;
    memset(&m->now, 0, sizeof m->now);
    return OK;
}

/* At rest, without forces. */
int model_start(Model *m, double t, char *message)
{
    (void)message;
    memset(m->now.x, 0, sizeof m->now.x);
    m->now.t = t;
    return OK;
}

int model_set(Model *m, size_t n, const unsigned refs[], const double values[], char *message)
{
    for (size_t k = 0; k < n; k++) {
        if (refs[k] >= SENSORS || !isfinite(values[k])) {
            snprintf(message, MESSAGE, refs[k] >= SENSORS
                         ? "value reference %u cannot be set (to %g); sensors are the first %d."
                         : "the sample of value reference %u = %g is not a finite number.",
                     refs[k], values[k], SENSORS);
            return ERROR;
        }
        m->now.y[refs[k]] = values[k];
    }
    return OK;
}

static double product(const double *row, const double *x, int n)
{
    double sum = 0.0;
    for (int j = 0; j < n; j++)
        sum += row[j] * x[j];
    return sum;
}

/* Sensors, then values, then their standard deviations. */
int model_get(Model *m, size_t n, const unsigned refs[], double values[], char *message)
{
    for (size_t k = 0; k < n; k++) {
        if (refs[k] >= SENSORS + 2 * VALUES) {
            snprintf(message, MESSAGE, "no variable has the value reference %u; all are < %d.",
                     refs[k], SENSORS + 2 * VALUES);
            return ERROR;
        }
        if (refs[k] < SENSORS)
            values[k] = m->now.y[refs[k]];
        else if (refs[k] < SENSORS + VALUES)
            values[k] = product(WANTED + (refs[k] - SENSORS) * STATES, m->now.x, STATES);
        else
            values[k] = DEVIATIONS[refs[k] - SENSORS - VALUES];
    }
    return OK;
}

int model_step(Model *m, double t, double h, char *message)
{
    double x[STATES];
    if (!(fabs(h - DT[0]) <= 1e-6 * DT[0])) {
        snprintf(message, MESSAGE, "the communication step %g s must be the %g s of the filter.", h,
                 DT[0]);
        return ERROR;
    }
    if (!(fabs(t - m->now.t) <= 1e-6 * fmax(h, 1e-3 * fabs(t)))) {
        snprintf(message, MESSAGE, "a step from t = %.9g s is asked for, the filter is at %.9g s.",
                 t, m->now.t);
        return ERROR;
    }
    for (int i = 0; i < STATES; i++) {
        x[i] = product(CLOSED + i * STATES, m->now.x, STATES)
               + product(DRIVEN + i * SENSORS, m->now.y, SENSORS);
        if (!isfinite(x[i])) {
            snprintf(message, MESSAGE, "the estimate is not finite after t = %.9g s.", t);
            return ERROR;
        }
    }
    memcpy(m->now.x, x, sizeof x);
    m->now.t = t + h;
    return OK;
}

int model_keep(Model *m, void **state, char *message)
{
    *state = malloc(sizeof m->now);
    if (!*state) {
        snprintf(message, MESSAGE, "no memory for a state.");
        return ERROR;
    }
    memcpy(*state, &m->now, sizeof m->now);
    return OK;
}

int model_recall(Model *m, void *state, char *message)
{
    (void)message;
    memcpy(&m->now, state, sizeof m->now);
    return OK;
}

int model_drop(Model *m, void *state, char *message)
{
    (void)m, (void)message;
    free(state);
    return OK;
}
