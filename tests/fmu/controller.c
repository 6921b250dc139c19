/* A controller of a joint behind the interface of FMI 2: its torque follows from inputs at once. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

enum { ANGLE, RATE, TARGET, GAIN, DAMPING, FAULT, TORQUE, STEPS, COUNT };
enum { SOUND, NOT_A_NUMBER, REFUSES, HANGS, CRASHES };
struct Model {
    double x[COUNT];
};

Model *model_open(const char *resources, char *message)
{
    (void)resources, (void)message;
    return calloc(1, sizeof(Model));
}

void model_close(Model *m) { free(m); }

int model_set(Model *m, size_t n, const unsigned refs[], const double values[], char *message)
{
    (void)message;
    for (size_t k = 0; k < n; k++)
        m->x[refs[k]] = values[k];
    return OK;
}

int model_get(Model *m, size_t n, const unsigned refs[], double values[], char *message)
{
    double *x = m->x;
    (void)message;
    x[TORQUE] = -x[GAIN] * (x[ANGLE] - x[TARGET]) - x[DAMPING] * x[RATE];
    if (x[FAULT] == NOT_A_NUMBER && x[STEPS] == 5)
        x[TORQUE] = NAN;
    for (size_t k = 0; k < n; k++)
        values[k] = x[refs[k]];
    return OK;
}

int model_start(Model *m, double t, char *message)
{
    (void)t, (void)message;
    m->x[STEPS] = 0;
    return OK;
}

int model_step(Model *m, double t, double h, char *message)
{
    (void)t, (void)h;
    if (++m->x[STEPS] < 5)
        return OK;
    if (m->x[FAULT] == CRASHES)
        abort();
    while (m->x[FAULT] == HANGS)
        ;
    strcpy(message, m->x[FAULT] == REFUSES ? "the battery is flat" : "");
    return m->x[FAULT] == REFUSES ? ERROR : OK;
}

int model_reset(Model *m, char *message) { return model_start(m, 0, message); }
int model_keep(Model *m, void **x, char *text) { return (void)m, (void)x, (void)text, ERROR; }
int model_recall(Model *m, void *x, char *text) { return (void)m, (void)x, (void)text, ERROR; }
int model_drop(Model *m, void *x, char *text) { return (void)m, (void)x, (void)text, ERROR; }
