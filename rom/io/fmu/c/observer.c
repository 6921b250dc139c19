/* A filter in its steady state: x <- CLOSED x + DRIVEN y over each step of DT, y the samples at its
   begin; the values WANTED x are estimates at its end. */
#include "model.h"
#include "tables.h" /* STATES, SENSORS, VALUES, DT, CLOSED, DRIVEN, WANTED, DEVIATIONS */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    double t, y[SENSORS], x[STATES];
} State;

struct Model {
    State now;
};

#include "filter.h"

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
    if (wrong_time(m, t, h, message))
        return ERROR;
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
