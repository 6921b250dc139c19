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

/* what importers look for, and nobody calls */
#define NO(name) int fmi3##name(void) { return 3; }
NO(ActivateModelPartition) NO(CompletedIntegratorStep) NO(DeserializeFMUState)
NO(EnterConfigurationMode) NO(EnterContinuousTimeMode) NO(EnterEventMode) NO(EnterStepMode)
NO(EvaluateDiscreteStates) NO(ExitConfigurationMode) NO(FreeFMUState) NO(GetAdjointDerivative)
NO(GetBinary) NO(GetBoolean) NO(GetClock) NO(GetContinuousStateDerivatives) NO(GetContinuousStates)
NO(GetDirectionalDerivative) NO(GetEventIndicators) NO(GetFMUState) NO(GetFloat32) NO(GetInt16)
NO(GetInt32) NO(GetInt64) NO(GetInt8) NO(GetIntervalDecimal) NO(GetIntervalFraction)
NO(GetNominalsOfContinuousStates) NO(GetNumberOfContinuousStates) NO(GetNumberOfEventIndicators)
NO(GetNumberOfVariableDependencies) NO(GetOutputDerivatives) NO(GetShiftDecimal)
NO(GetShiftFraction) NO(GetString) NO(GetUInt16) NO(GetUInt32) NO(GetUInt64) NO(GetUInt8)
NO(GetVariableDependencies) NO(GetVersion) NO(InstantiateModelExchange)
NO(InstantiateScheduledExecution) NO(Reset) NO(SerializeFMUState) NO(SerializedFMUStateSize)
NO(SetBinary) NO(SetBoolean) NO(SetClock) NO(SetContinuousStates) NO(SetDebugLogging)
NO(SetFMUState) NO(SetFloat32) NO(SetInt16) NO(SetInt32) NO(SetInt64) NO(SetInt8)
NO(SetIntervalDecimal) NO(SetIntervalFraction) NO(SetShiftDecimal) NO(SetShiftFraction)
NO(SetString) NO(SetTime) NO(SetUInt16) NO(SetUInt32) NO(SetUInt64) NO(SetUInt8) NO(Terminate)
NO(UpdateDiscreteStates)
