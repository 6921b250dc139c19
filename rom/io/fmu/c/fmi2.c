/* FMI 2.0 for co-simulation around a model, see model.h. Only real variables; inputs are held
   over a step. Source: Functional Mock-up Interface for Model Exchange and Co-Simulation 2.0. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config.h" /* GUID */
#include "model.h"

typedef const char *String;
typedef struct {
    void (*logger)(void *environment, String instance, int status, String category, String text,
                   ...);
    void *(*allocate)(size_t count, size_t size);
    void (*release)(void *memory);
    void (*finished)(void *environment, int status);
    void *environment;
} Callbacks;

enum Phase { INSTANTIATED, INITIALISING, STEPPING, TERMINATED };

typedef struct {
    Callbacks callbacks;
    char *name;
    Model *model;
    enum Phase phase;
    double start, reached;
    char message[MESSAGE]; /* of the call under way */
} Instance;

#ifdef _WIN32
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif

/* The logger formats its text like printf. */
static void tell(const Callbacks *callbacks, String name, int status, String message)
{
    char text[2 * MESSAGE];
    size_t k = 0;
    if (!callbacks->logger)
        return;
    for (; *message && k < sizeof text - 2; message++) {
        if (*message == '%')
            text[k++] = '%';
        text[k++] = *message;
    }
    text[k] = 0;
    callbacks->logger(callbacks->environment, name, status,
                      status == WARNING ? "logStatusWarning" : "logStatusError", text);
}

static int answer(Instance *x, int status)
{
    if (*x->message)
        tell(&x->callbacks, x->name, status == OK ? WARNING : status, x->message);
    x->message[0] = 0;
    return status;
}

static int unsupported(void *instance, String what)
{
    Instance *x = instance;
    snprintf(x->message, MESSAGE, "%s is not offered by this FMU.", what);
    return answer(x, ERROR);
}

static int wrong_phase(Instance *x, String what)
{
    static const String phases[] = {"before its initialisation", "in its initialisation",
                                    "after its initialisation", "after its end"};
    snprintf(x->message, MESSAGE, "%s is not allowed for an instance %s.", what, phases[x->phase]);
    return answer(x, ERROR);
}

/* file:///a%20b or file:/a%20b -> /a b */
static char *path_of(String uri)
{
    char *path, *out;
    if (!strncmp(uri, "file:", 5)) {
        uri += 5;
        if (!strncmp(uri, "//", 2))
            uri = strchr(uri + 2, '/') ? strchr(uri + 2, '/') : uri + 2;
    }
    out = path = malloc(strlen(uri) + 1);
    while (path && *uri) {
        int escaped = *uri == '%' && strspn(uri + 1, "0123456789abcdefABCDEF") > 1;
        char digits[3] = "";
        if (escaped)
            memcpy(digits, uri + 1, 2);
        *out++ = escaped ? (char)strtol(digits, NULL, 16) : *uri;
        uri += escaped ? 3 : 1;
    }
    if (path)
        *out = 0;
    return path;
}

API String fmi2GetTypesPlatform(void) { return "default"; }
API String fmi2GetVersion(void) { return "2.0"; }

API void fmi2FreeInstance(void *instance)
{
    Instance *x = instance;
    if (!x)
        return;
    if (x->model)
        model_close(x->model);
    free(x->name);
    free(x);
}

API void *fmi2Instantiate(String name, int type, String guid, String resources,
                          const Callbacks *callbacks, int visible, int logging)
{
    char message[MESSAGE] = "no memory";
    Instance *x = calloc(1, sizeof *x);
    char *folder = path_of(resources ? resources : "");
    (void)visible, (void)logging;
    if (x) {
        x->callbacks = *callbacks;
        x->name = malloc(strlen(name ? name : "") + 1);
        if (x->name)
            strcpy(x->name, name ? name : "");
        if (type != 1)
            strcpy(message, "this FMU is for co-simulation, not for model exchange.");
        else if (!guid || strcmp(guid, GUID))
            snprintf(message, sizeof message,
                     "the GUID of the model description is %.80s, that of the binary %s: they are "
                     "not of the same FMU.", guid ? guid : "missing", GUID);
        else if (folder && x->name)
            x->model = model_open(folder, message);
    }
    free(folder);
    if (x && x->model)
        return x;
    tell(callbacks, name, ERROR, message);
    fmi2FreeInstance(x);
    return NULL;
}

API int fmi2SetDebugLogging(void *instance, int on, size_t n, const String categories[])
{
    (void)instance, (void)on, (void)n, (void)categories;
    return OK;
}

API int fmi2SetupExperiment(void *instance, int has_tolerance, double tolerance, double start,
                            int has_stop, double stop)
{
    Instance *x = instance;
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    if (x->phase != INSTANTIATED)
        return wrong_phase(x, "fmi2SetupExperiment");
    x->start = x->reached = start;
    return OK;
}

API int fmi2EnterInitializationMode(void *instance)
{
    Instance *x = instance;
    if (x->phase != INSTANTIATED)
        return wrong_phase(x, "fmi2EnterInitializationMode");
    x->phase = INITIALISING;
    return OK;
}

API int fmi2ExitInitializationMode(void *instance)
{
    Instance *x = instance;
    int status;
    if (x->phase != INITIALISING)
        return wrong_phase(x, "fmi2ExitInitializationMode");
    status = model_start(x->model, x->start, x->message);
    if (status == OK)
        x->phase = STEPPING;
    return answer(x, status);
}

API int fmi2Terminate(void *instance)
{
    Instance *x = instance;
    if (x->phase != STEPPING)
        return wrong_phase(x, "fmi2Terminate");
    x->phase = TERMINATED;
    return OK;
}

API int fmi2Reset(void *instance)
{
    Instance *x = instance;
    int status = model_reset(x->model, x->message);
    if (status == OK)
        x->phase = INSTANTIATED;
    return answer(x, status);
}

API int fmi2DoStep(void *instance, double t, double h, int no_way_back)
{
    Instance *x = instance;
    int status;
    (void)no_way_back;
    if (x->phase != STEPPING)
        return wrong_phase(x, "fmi2DoStep");
    status = model_step(x->model, t, h, x->message);
    if (status == OK)
        x->reached = t + h;
    return answer(x, status);
}

API int fmi2SetReal(void *instance, const unsigned refs[], size_t n, const double values[])
{
    Instance *x = instance;
    if (x->phase == TERMINATED)
        return wrong_phase(x, "fmi2SetReal");
    return answer(x, model_set(x->model, n, refs, values, x->message));
}

/* Before the end of the initialisation outputs follow from the inputs of that moment. */
API int fmi2GetReal(void *instance, const unsigned refs[], size_t n, double values[])
{
    Instance *x = instance;
    int status = OK;
    if (x->phase == INITIALISING)
        status = model_start(x->model, x->start, x->message);
    if (status == OK)
        status = model_get(x->model, n, refs, values, x->message);
    return answer(x, status);
}

API int fmi2GetFMUstate(void *instance, void **state)
{
    Instance *x = instance;
    int status = OK;
    if (x->phase != STEPPING)
        return wrong_phase(x, "fmi2GetFMUstate");
    if (*state)
        status = model_drop(x->model, *state, x->message);
    if (status == OK)
        status = model_keep(x->model, state, x->message);
    return answer(x, status);
}

API int fmi2SetFMUstate(void *instance, void *state)
{
    Instance *x = instance;
    int status = model_recall(x->model, state, x->message);
    if (status == OK)
        x->phase = STEPPING;
    return answer(x, status);
}

API int fmi2FreeFMUstate(void *instance, void **state)
{
    Instance *x = instance;
    int status = OK;
    if (*state)
        status = model_drop(x->model, *state, x->message);
    *state = NULL;
    return answer(x, status);
}

API int fmi2GetRealStatus(void *instance, int kind, double *value)
{
    Instance *x = instance;
    if (kind != 2) /* fmi2LastSuccessfulTime */
        return unsupported(instance, "this status");
    *value = x->reached;
    return OK;
}

#define NONE(name, type)                                                                           \
    API int name(void *instance, const unsigned refs[], size_t n, type values[])                   \
    {                                                                                              \
        (void)refs, (void)values;                                                                  \
        return n ? unsupported(instance, #name) : OK;                                              \
    }
NONE(fmi2GetInteger, int)
NONE(fmi2GetBoolean, int)
NONE(fmi2GetString, String)
NONE(fmi2SetInteger, const int)
NONE(fmi2SetBoolean, const int)
NONE(fmi2SetString, const String)

#define REFUSE(name, ...)                                                                          \
    API int name(void *instance, __VA_ARGS__) { return unsupported(instance, #name); }
REFUSE(fmi2SerializedFMUstateSize, void *s, size_t *n)
REFUSE(fmi2SerializeFMUstate, void *s, char b[], size_t n)
REFUSE(fmi2DeSerializeFMUstate, const char b[], size_t n, void **s)
REFUSE(fmi2GetDirectionalDerivative, const unsigned a[], size_t n, const unsigned b[], size_t m,
       const double x[], double y[])
REFUSE(fmi2SetRealInputDerivatives, const unsigned a[], size_t n, const int o[], const double x[])
REFUSE(fmi2GetRealOutputDerivatives, const unsigned a[], size_t n, const int o[], double x[])
REFUSE(fmi2GetStatus, int kind, int *value)
REFUSE(fmi2GetIntegerStatus, int kind, int *value)
REFUSE(fmi2GetBooleanStatus, int kind, int *value)
REFUSE(fmi2GetStringStatus, int kind, String *value)

API int fmi2CancelStep(void *instance) { return unsupported(instance, "fmi2CancelStep"); }
