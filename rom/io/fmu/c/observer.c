/* A filter in its steady state: x <- CLOSED x + DRIVEN y over each step of DT, y the samples at its
   begin; the values WANTED x are estimates at its end. */
#include "model.h"
#include "tables.h" /* STATES, SENSORS, VALUES, DT, CLOSED, DRIVEN, WANTED, DEVIATIONS */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { INPUTS = SENSORS, VARIABLES = SENSORS + 2 * VALUES };

typedef struct {
    double t, given[SENSORS], x[STATES];
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

/* Values, then their standard deviations. */
static double output(const Model *m, unsigned k)
{
    return k < VALUES ? product(WANTED + k * STATES, m->now.x, STATES) : DEVIATIONS[k - VALUES];
}

int model_step(Model *m, double t, double h, char *message)
{
    double x[STATES];
    if (wrong_time(m, t, h, message))
        return ERROR;
    for (int i = 0; i < STATES; i++) {
        x[i] = product(CLOSED + i * STATES, m->now.x, STATES)
               + product(DRIVEN + i * SENSORS, m->now.given, SENSORS);
        if (!isfinite(x[i])) {
            snprintf(message, MESSAGE, "the estimate is not finite after t = %.9g s.", t);
            return ERROR;
        }
    }
    memcpy(m->now.x, x, sizeof x);
    m->now.t = t + h;
    return OK;
}

#include "shared.h"
