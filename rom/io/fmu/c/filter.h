/* What all filters share. Before it: DT of the tables, and a Model whose State `now` has the time t
   at which it is. */

static double product(const double *row, const double *x, int n)
{
    double sum = 0.0;
    for (int j = 0; j < n; j++)
        sum += row[j] * x[j];
    return sum;
}

/* Steps follow each other and are as long as those of the filter. */
static int wrong_time(const Model *m, double t, double h, char *message)
{
    if (!(fabs(h - DT[0]) <= 1e-6 * DT[0])) {
        snprintf(message, MESSAGE, "the communication step %g s must be the %g s of the filter.", h,
                 DT[0]);
        return 1;
    }
    if (!(fabs(t - m->now.t) <= 1e-6 * fmax(h, 1e-3 * fabs(t)))) {
        snprintf(message, MESSAGE, "a step from t = %.9g s is asked for, the filter is at %.9g s.",
                 t, m->now.t);
        return 1;
    }
    return 0;
}
