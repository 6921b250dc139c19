/* An extended Kalman filter whose last states are logarithms of factors. The equations are
   linearised at a point of these and bilinear in their distance from it; when one is REACH away,
   the point moves after it. A step takes a prediction from the samples before, then those at its
   begin; values are estimates at the time of the samples. */
#include "model.h"
#include "tables.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    M = MODES,
    S = 2 * MODES + FORCES, /* states without parameters */
    N = S + PARAMETERS,
    V = WANTED + FORCES, /* values without parameters */
    ALL = V + PARAMETERS,
    INPUTS = SENSORS,
    VARIABLES = SENSORS + 2 * ALL,
    TERMS_OF_SERIES = 24 /* of exponentials of matrices of norm 1/2: to the last digit */
};

typedef struct {
    double t, given[SENSORS], z[N], P[N * N], values[ALL], deviations[ALL];
    int begun;
    /* the equations of a step about the point */
    double point[PARAMETERS], A[S * S], dA[PARAMETERS * S * S], Q[N * N];
    double C[SENSORS * S], dC[PARAMETERS * SENSORS * S], W[V * S], dW[PARAMETERS * V * S];
} State;

struct Model {
    State now;
    double F[S * N], T[N * N], row[N], push[N];
    double rates[S * S], drates[PARAMETERS * S * S], term[S * S], next[S * S], work[S * S];
    double dterm[PARAMETERS * S * S], noise[S * S], acc[M * S], dacc[PARAMETERS * M * S];
    double K[M * M], mass[M * M], used[M * M], dmass[M * M];
};

#include "filter.h"

/* C = A B, C += factor A and C = factor (A + A'), square matrices of S rows */
static void times(double *C, const double *A, const double *B)
{
    for (int i = 0; i < S; i++) {
        for (int j = 0; j < S; j++)
            C[i * S + j] = 0.0;
        for (int k = 0; k < S; k++)
            for (int j = 0; j < S; j++)
                C[i * S + j] += A[i * S + k] * B[k * S + j];
    }
}

static void add(double *C, double factor, const double *A)
{
    for (int i = 0; i < S * S; i++)
        C[i] += factor * A[i];
}

static void transpose_added(double *C, const double *A, double factor)
{
    for (int i = 0; i < S; i++)
        for (int j = 0; j < S; j++)
            C[i * S + j] = factor * (A[i * S + j] + A[j * S + i]);
}

/* X (M, S) <- mass^-1 X, by elimination with pivots; the mass is lost */
static int solve(double *mass, double *X)
{
    for (int k = 0; k < M; k++) {
        int best = k;
        for (int i = k + 1; i < M; i++)
            if (fabs(mass[i * M + k]) > fabs(mass[best * M + k]))
                best = i;
        if (!(fabs(mass[best * M + k]) > 0.0))
            return 1;
        for (int j = 0; j < M && best != k; j++) {
            double a = mass[k * M + j];
            mass[k * M + j] = mass[best * M + j];
            mass[best * M + j] = a;
        }
        for (int j = 0; j < S && best != k; j++) {
            double a = X[k * S + j];
            X[k * S + j] = X[best * S + j];
            X[best * S + j] = a;
        }
        for (int i = k + 1; i < M; i++) {
            double factor = mass[i * M + k] / mass[k * M + k];
            for (int j = k; j < M; j++)
                mass[i * M + j] -= factor * mass[k * M + j];
            for (int j = 0; j < S; j++)
                X[i * S + j] -= factor * X[k * S + j];
        }
    }
    for (int i = M - 1; i >= 0; i--)
        for (int j = 0; j < S; j++) {
            for (int k = i + 1; k < M; k++)
                X[i * S + j] -= mass[i * M + k] * X[k * S + j];
            X[i * S + j] /= mass[i * M + i];
        }
    return 0;
}

/* accelerations (M, S) of the modes by the state, and their derivatives (PARAMETERS, M, S) */
static int accelerations(Model *m, const double *k, const double *mk)
{
    double *K = m->K, *mass = m->mass, *used = m->used, *dmass = m->dmass, *acc = m->acc;
    size_t size = sizeof m->K;
    memset(K, 0, size);
    memset(mass, 0, size);
    for (int t = 0; t < TERMS; t++)
        for (int i = 0; i < M * M; i++) {
            K[i] += k[t] * STIFFNESS[t * M * M + i];
            mass[i] += mk[t] * MASS[t * M * M + i];
        }
    for (int i = 0; i < M; i++) {
        for (int j = 0; j < M; j++) {
            acc[i * S + j] = -K[i * M + j] / SCALE[j];
            acc[i * S + M + j] = -DAMPING[i * M + j];
        }
        for (int j = 0; j < FORCES; j++)
            acc[i * S + 2 * M + j] = DRIVEN[i * FORCES + j];
    }
    memcpy(used, mass, size);
    if (solve(used, acc))
        return 1;
    for (int p = 0; p < PARAMETERS; p++) {
        double *right = m->dacc + p * M * S;
        memset(K, 0, size);
        memset(dmass, 0, size);
        for (int t = 0; t < TERMS; t++)
            for (int i = 0; i < M * M; i++) {
                K[i] += K_POWERS[t * PARAMETERS + p] * k[t] * STIFFNESS[t * M * M + i];
                dmass[i] += M_POWERS[t * PARAMETERS + p] * mk[t] * MASS[t * M * M + i];
            }
        for (int i = 0; i < M; i++)
            for (int j = 0; j < S; j++) {
                double sum = j < M ? -K[i * M + j] / SCALE[j] : 0.0;
                for (int l = 0; l < M; l++)
                    sum -= dmass[i * M + l] * acc[l * S + j];
                right[i * S + j] = sum;
            }
        memcpy(used, mass, size);
        if (solve(used, right))
            return 1;
    }
    return 0;
}

/* rows (n, S) of sensors or of what is wanted, and their derivatives (PARAMETERS, n_all, S) */
static void rows(int n, int n_all, const double *k, const double *acc, const double *dacc,
                 const double *still, const double *carried, const double *moving,
                 const double *pushed, double *C, double *dC)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < S; j++) {
            double sum = 0.0;
            for (int l = 0; l < M; l++)
                sum += pushed[i * M + l] * acc[l * S + j];
            if (j < M) {
                double y = still[i * M + j];
                for (int t = 0; t < TERMS; t++)
                    y += k[t] * carried[(t * n + i) * M + j];
                sum += y / SCALE[j];
            } else if (j < 2 * M)
                sum += moving[i * M + j - M];
            C[i * S + j] = sum;
            for (int p = 0; p < PARAMETERS; p++) {
                double change = 0.0;
                for (int l = 0; l < M; l++)
                    change += pushed[i * M + l] * dacc[(p * M + l) * S + j];
                for (int t = 0; j < M && t < TERMS; t++)
                    change += K_POWERS[t * PARAMETERS + p] * k[t] * carried[(t * n + i) * M + j]
                              / SCALE[j];
                dC[(p * n_all + i) * S + j] = change;
            }
        }
}

/* transition over a step, its derivatives, and the noise: series for a short one, then doublings */
static void discrete(Model *m)
{
    State *s = &m->now;
    double norm = 0.0, *noise = m->noise;
    for (int i = 0; i < S; i++) {
        double sum = 0.0;
        for (int j = 0; j < S; j++)
            sum += fabs(m->rates[i * S + j]);
        norm = fmax(norm, sum);
    }
    int halvings = (int)fmax(0.0, ceil(log2(fmax(norm * DT[0] / 0.5, 1.0))));
    double h = DT[0] / pow(2.0, halvings);
    memset(s->A, 0, sizeof s->A);
    memset(s->dA, 0, sizeof s->dA);
    memset(m->dterm, 0, sizeof m->dterm);
    memset(m->term, 0, sizeof m->term);
    memset(m->next, 0, sizeof m->next);
    for (int i = 0; i < S; i++) {
        m->term[i * S + i] = s->A[i * S + i] = 1.0;
        m->next[i * S + i] = WHITE[i] * h;
    }
    memcpy(noise, m->next, sizeof m->noise);
    for (int k = 1; k <= TERMS_OF_SERIES; k++) {
        for (int p = 0; p < PARAMETERS; p++) { /* (A h)^k / k! and its derivative */
            double *own = m->dterm + p * S * S;
            times(m->work, m->rates, own);
            memcpy(own, m->work, sizeof m->work);
            times(m->work, m->drates + p * S * S, m->term);
            for (int i = 0; i < S * S; i++)
                own[i] = (own[i] + m->work[i]) * h / k;
            add(s->dA + p * S * S, 1.0, own);
        }
        times(m->work, m->rates, m->term);
        for (int i = 0; i < S * S; i++)
            m->term[i] = m->work[i] * h / k;
        add(s->A, 1.0, m->term);
        times(m->work, m->rates, m->next); /* Q_k+1 = (A Q_k + Q_k A') h / (k + 1) */
        transpose_added(m->next, m->work, h / (k + 1));
        add(noise, 1.0, m->next);
    }
    for (int d = 0; d < halvings; d++) {
        times(m->work, s->A, noise);
        for (int i = 0; i < S; i++) /* next = E Q E' */
            for (int j = 0; j < S; j++)
                m->next[i * S + j] = product(m->work + i * S, s->A + j * S, S);
        add(noise, 1.0, m->next);
        for (int p = 0; p < PARAMETERS; p++) {
            double *own = s->dA + p * S * S;
            times(m->work, own, s->A);
            times(m->next, s->A, own);
            add(m->work, 1.0, m->next);
            memcpy(own, m->work, sizeof m->work);
        }
        times(m->work, s->A, s->A);
        memcpy(s->A, m->work, sizeof m->work);
    }
    memset(s->Q, 0, sizeof s->Q);
    transpose_added(m->work, noise, 0.5);
    for (int i = 0; i < S; i++)
        memcpy(s->Q + i * N, m->work + i * S, S * sizeof(double));
    for (int p = 0; p < PARAMETERS; p++)
        s->Q[(S + p) * N + S + p] = WALKS[p];
}

/* the point moves to where the parameters are */
static int linearise(Model *m, char *message)
{
    State *s = &m->now;
    double k[TERMS], mass[TERMS], *acc = m->acc, *dacc = m->dacc;
    for (int p = 0; p < PARAMETERS; p++) {
        s->point[p] = s->z[S + p];
        if (!(LOW[p] <= s->point[p] && s->point[p] <= HIGH[p])) {
            snprintf(message, MESSAGE, "parameter '%s' has reached the factor %.4g; the family goes "
                     "from %.4g to %.4g.", NAMES[p], exp(s->point[p]), exp(LOW[p]), exp(HIGH[p]));
            return ERROR;
        }
    }
    for (int t = 0; t < TERMS; t++) {
        k[t] = exp(product(K_POWERS + t * PARAMETERS, s->point, PARAMETERS));
        mass[t] = exp(product(M_POWERS + t * PARAMETERS, s->point, PARAMETERS));
    }
    if (accelerations(m, k, mass)) {
        snprintf(message, MESSAGE, "the mass is singular.");
        return ERROR;
    }
    memset(m->rates, 0, sizeof m->rates);
    memset(m->drates, 0, sizeof m->drates);
    for (int i = 0; i < M; i++) {
        m->rates[i * S + M + i] = SCALE[i];
        memcpy(m->rates + (M + i) * S, acc + i * S, S * sizeof(double));
        for (int p = 0; p < PARAMETERS; p++)
            memcpy(m->drates + (p * S + M + i) * S, dacc + (p * M + i) * S, S * sizeof(double));
    }
    rows(SENSORS, SENSORS, k, acc, dacc, SEEN_STILL, SEEN_CARRIED, SEEN_MOVING, SEEN_PUSHED, s->C,
         s->dC);
    memset(s->W, 0, sizeof s->W);
    memset(s->dW, 0, sizeof s->dW);
    rows(WANTED, V, k, acc, dacc, WANTED_STILL, WANTED_CARRIED, WANTED_MOVING, WANTED_PUSHED, s->W,
         s->dW);
    for (int e = 0; e < FORCES; e++)
        s->W[(WANTED + e) * S + 2 * M + e] = 1.0;
    discrete(m);
    return OK;
}

/* row i of n: its derivative by the state into c (N); the value itself */
static double seen(const State *s, const double *C, const double *dC, int n, int i, double *c)
{
    memcpy(c, C + i * S, S * sizeof(double));
    for (int p = 0; p < PARAMETERS; p++) {
        const double *own = dC + (p * n + i) * S;
        double d = s->z[S + p] - s->point[p];
        for (int a = 0; a < S; a++)
            c[a] += d * own[a];
        c[S + p] = product(own, s->z, S);
    }
    return product(c, s->z, S);
}

static void predict(Model *m)
{
    State *s = &m->now;
    for (int i = 0; i < S; i++)
        m->row[i] = seen(s, s->A, s->dA, S, i, m->F + i * N);
    memcpy(s->z, m->row, S * sizeof(double));
    memcpy(m->T, s->P, sizeof m->T);
    memset(m->T, 0, S * N * sizeof(double));
    for (int i = 0; i < S; i++)
        for (int a = 0; a < N; a++)
            for (int b = 0; b < N; b++)
                m->T[i * N + b] += m->F[i * N + a] * s->P[a * N + b];
    for (int i = 0; i < N; i++)
        for (int b = 0; b <= i; b++) {
            double moved = b >= S ? m->T[i * N + b] : product(m->T + i * N, m->F + b * N, N);
            s->P[i * N + b] = s->P[b * N + i] = s->Q[i * N + b] + moved;
        }
}

static void correct(Model *m)
{
    State *s = &m->now;
    for (int i = 0; i < SENSORS; i++) {
        double e = s->given[i] - seen(s, s->C, s->dC, SENSORS, i, m->row), spread = VARIANCES[i];
        for (int a = 0; a < N; a++) {
            m->push[a] = product(s->P + a * N, m->row, N);
            spread += m->row[a] * m->push[a];
        }
        for (int a = 0; a < N; a++) {
            s->z[a] += m->push[a] * (e / spread);
            for (int b = 0; b <= a; b++)
                s->P[b * N + a] = s->P[a * N + b] -= m->push[a] * m->push[b] / spread;
        }
    }
}

static void tell(Model *m)
{
    State *s = &m->now;
    for (int i = 0; i < V; i++) {
        double spread = 0.0;
        s->values[i] = seen(s, s->W, s->dW, V, i, m->row);
        for (int a = 0; a < N; a++)
            spread += m->row[a] * product(s->P + a * N, m->row, N);
        s->deviations[i] = sqrt(fmax(spread, 0.0));
    }
    for (int p = 0; p < PARAMETERS; p++) {
        s->values[V + p] = exp(s->z[S + p]);
        s->deviations[V + p] = sqrt(fmax(s->P[(S + p) * (N + 1)], 0.0));
    }
}

/* At rest, forces unknown and factors of one. */
int model_start(Model *m, double t, char *message)
{
    State *s = &m->now;
    s->t = t;
    s->begun = 0;
    memset(s->z, 0, sizeof s->z);
    memset(s->P, 0, sizeof s->P);
    for (int i = 0; i < N; i++)
        s->P[i * N + i] = BEFORE[i];
    if (linearise(m, message))
        return ERROR;
    tell(m);
    return OK;
}

int model_reset(Model *m, char *message)
{
    memset(&m->now, 0, sizeof m->now);
    return model_start(m, 0.0, message);
}

/* Values, then their standard deviations. */
static double output(const Model *m, unsigned k)
{
    return k < ALL ? m->now.values[k] : m->now.deviations[k - ALL];
}

int model_step(Model *m, double t, double h, char *message)
{
    State *s = &m->now;
    if (wrong_time(m, t, h, message))
        return ERROR;
    if (s->begun)
        predict(m);
    s->begun = 1;
    correct(m);
    for (int a = 0; a < N; a++)
        if (!isfinite(s->z[a])) {
            snprintf(message, MESSAGE, "the estimate is not finite after t = %.9g s.", t);
            return ERROR;
        }
    tell(m);
    s->t = t + h;
    for (int p = 0; p < PARAMETERS; p++)
        if (!(fabs(s->z[S + p] - s->point[p]) <= REACH[0]))
            return linearise(m, message);
    return OK;
}

#include "shared.h"
