/* A body that vibrates, with small rigid motions: for modal coordinates y of unit mass

       y'' + XI y' + diag(OMEGA^2) y = LOADS u,    displacements MOTION y, velocities MOTION y'

   The inputs u are held over a step, so that the step is exact but for round-off: the exponential
   of [[A, B], [0, 0]] h, by Taylor series, scaling and squaring, once for each length h. State is
   (s y, y') with s = max(OMEGA, 1), in which undamped vibrations only turn. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"
#include "tables.h" /* MODES, INTERFACES, OMEGA, XI, LOADS, MOTION */

enum { INPUTS = 6 * INTERFACES + 3, VARIABLES = INPUTS + 12 * INTERFACES, SIZE = 3 * MODES };
enum { TAYLOR = 17 }; /* terms; 0.5^18 / 18! is below round-off */

typedef struct {
    double t, given[INPUTS], s[MODES], v[MODES];
} State;

struct Model {
    State now;
    double h;                                             /* of the propagator */
    double E[SIZE * SIZE], W[SIZE * SIZE], T[SIZE * SIZE]; /* propagator, and places to work */
};

static double scale(int k) { return OMEGA[k] > 1.0 ? OMEGA[k] : 1.0; }

static void product(const double *A, const double *B, double *C)
{
    memset(C, 0, sizeof(double) * SIZE * SIZE);
    for (int i = 0; i < SIZE; i++)
        for (int k = 0; k < SIZE; k++) {
            double a = A[i * SIZE + k];
            if (a != 0.0)
                for (int j = 0; j < SIZE; j++)
                    C[i * SIZE + j] += a * B[k * SIZE + j];
        }
}

/* The rates of (s y, y', load), times h. */
static double generator(double *A, double h)
{
    double largest = 0.0;
    memset(A, 0, sizeof(double) * SIZE * SIZE);
    for (int i = 0; i < MODES; i++) {
        double *row = A + (MODES + i) * SIZE, sum = scale(i);
        A[i * SIZE + MODES + i] = h * scale(i);
        row[i] = -h * OMEGA[i] * OMEGA[i] / scale(i);
        for (int j = 0; j < MODES; j++) {
            row[MODES + j] = -h * XI[i * MODES + j];
            sum += fabs(XI[i * MODES + j]);
        }
        row[2 * MODES + i] = h;
        largest = fmax(largest, h * (sum + 1.0));
    }
    return largest;
}

static int propagator(Model *m, double h)
{
    double largest;
    int halvings = 0;
    if (fabs(h - m->h) <= 1e-12 * h)
        return 1;
    largest = generator(m->W, h);
    if (!isfinite(largest))
        return 0;
    for (; largest > 0.5; largest /= 2)
        halvings++;
    for (int k = 0; k < SIZE * SIZE; k++) {
        m->W[k] = ldexp(m->W[k], -halvings);
        m->E[k] = k % (SIZE + 1) ? 0.0 : 1.0;
    }
    for (int k = TAYLOR; k > 0; k--) { /* E <- 1 + W E / k */
        product(m->W, m->E, m->T);
        for (int j = 0; j < SIZE * SIZE; j++)
            m->E[j] = m->T[j] / k + (j % (SIZE + 1) ? 0.0 : 1.0);
    }
    while (halvings--) {
        product(m->E, m->E, m->T);
        memcpy(m->E, m->T, sizeof m->E);
    }
    m->h = h;
    return 1;
}

int model_reset(Model *m, char *message)
{
    (void)message;
    memset(&m->now, 0, sizeof m->now);
    m->h = -1.0;
    return OK;
}

/* At rest and undeformed. */
int model_start(Model *m, double t, char *message)
{
    (void)message;
    memset(m->now.s, 0, sizeof m->now.s);
    memset(m->now.v, 0, sizeof m->now.v);
    m->now.t = t;
    return OK;
}

/* Of each interface 6 displacements, then 6 velocities. */
static double output(const Model *m, unsigned k)
{
    const double *row = MOTION + (6 * (k / 12) + k % 6) * MODES;
    double sum = 0.0;
    for (int j = 0; j < MODES; j++)
        sum += row[j] * (k % 12 < 6 ? m->now.s[j] / scale(j) : m->now.v[j]);
    return sum;
}

int model_step(Model *m, double t, double h, char *message)
{
    double x[SIZE], y[2 * MODES];
    if (!(h > 0.0) || !isfinite(h) || !propagator(m, h)) {
        snprintf(message, MESSAGE, "the communication step %g s must be positive and finite.", h);
        return ERROR;
    }
    if (!(fabs(t - m->now.t) <= 1e-9 * fmax(h, 1e-3 * fabs(t)))) {
        snprintf(message, MESSAGE, "a step from t = %.9g s is asked for, the body is at %.9g s.", t,
                 m->now.t);
        return ERROR;
    }
    memcpy(x, m->now.s, sizeof m->now.s);
    memcpy(x + MODES, m->now.v, sizeof m->now.v);
    for (int i = 0; i < MODES; i++) {
        x[2 * MODES + i] = 0.0;
        for (int j = 0; j < INPUTS; j++)
            x[2 * MODES + i] += LOADS[i * INPUTS + j] * m->now.given[j];
    }
    for (int i = 0; i < 2 * MODES; i++) {
        y[i] = 0.0;
        for (int j = 0; j < SIZE; j++)
            y[i] += m->E[i * SIZE + j] * x[j];
        if (!isfinite(y[i])) {
            snprintf(message, MESSAGE, "the motion is not finite after t = %.9g s.", t);
            return ERROR;
        }
    }
    memcpy(m->now.s, y, sizeof m->now.s);
    memcpy(m->now.v, y + MODES, sizeof m->now.v);
    m->now.t = t + h;
    return OK;
}

#include "shared.h"
