/* The same of FMI 3, the little that is asked of it. */
#include <stdbool.h>
#include <stdlib.h>

void *fmi3InstantiateCoSimulation(void) { return calloc(6, sizeof(double)); }
void fmi3FreeInstance(void *x) { free(x); }
int fmi3EnterInitializationMode(void) { return 0; }
int fmi3ExitInitializationMode(void) { return 0; }

int fmi3SetFloat64(double *x, const unsigned refs[], size_t n, const double values[], size_t count)
{
    (void)count;
    for (size_t k = 0; k < n; k++)
        x[refs[k]] = values[k];
    return 0;
}

int fmi3GetFloat64(double *x, const unsigned refs[], size_t n, double values[], size_t count)
{
    (void)refs, (void)n, (void)count;
    values[0] = -x[3] * (x[0] - x[2]) - x[4] * x[1];
    return 0;
}

int fmi3DoStep(double *x, double t, double h, bool kept, bool *event, bool *end, bool *early,
               double *last)
{
    (void)x, (void)kept;
    *event = *end = *early = false;
    *last = t + h;
    return 0;
}
