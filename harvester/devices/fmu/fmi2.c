/* The interface FMI 2.0 for co-simulation (fmi-standard.org); types and functions as that standard has them. */

#include "part.h"

#if defined(_WIN32)
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif

typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef void (*fmi2Logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
typedef struct {
    fmi2Logger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment environment;
} fmi2CallbackFunctions;

/* The first line of a function: an instance that is NULL or was freed has a status. */
#define ALIVE(c) \
    if (!is_alive(c)) return fmi2Error

static const fmi2Status STATUS[] = {fmi2OK, fmi2Discard, fmi2Error};

static void say(Part *part, const char *words) {
    if (part->logger)
        ((fmi2Logger)part->logger)(part->environment, part->name, fmi2Error, "logStatusError", "%s", words);
}

API const char *fmi2GetTypesPlatform(void) { return "default"; }
API const char *fmi2GetVersion(void) { return "2.0"; }
API fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) { return fmi2OK; }

API fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                  const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    if (type != fmi2CoSimulation || !guid || strcmp(guid, TOKEN)) {
        if (callbacks && callbacks->logger)
            callbacks->logger(callbacks->environment, name, fmi2Error, "logStatusError", "%s",
                              type != fmi2CoSimulation ? "the type must be co-simulation"
                                                       : "the guid must be that of modelDescription.xml");
        return NULL;
    }
    Part *part = made(name);
    if (!part || !callbacks) return part;
    part->environment = callbacks->environment;
    part->logger = (void *)callbacks->logger;
    part->say = say;
    return part;
}
API void fmi2FreeInstance(fmi2Component c) { unmade(c); }

API fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean t, fmi2Real tolerance, fmi2Real start, fmi2Boolean e, fmi2Real stop) {
    ALIVE(c);
    Data *d = &((Part *)c)->data;
    if (d->phase != CREATED || !isfinite(start)) return fmi2Error;
    d->time = d->origin = start;
    return fmi2OK;
}
API fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    ALIVE(c);
    Data *d = &((Part *)c)->data;
    if (d->phase != CREATED) return fmi2Error;
    d->phase = INITIALISING;
    d->stale = 1;
    return fmi2OK;
}
API fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    ALIVE(c);
    Part *part = c;
    if (part->data.phase != INITIALISING || !begin(part)) return fmi2Error;
    part->data.phase = RUNNING;
    return fmi2OK;
}
API fmi2Status fmi2Terminate(fmi2Component c) {
    ALIVE(c);
    Data *d = &((Part *)c)->data;
    if (d->phase != RUNNING) {
        complain(c, "the initialisation must be over before the end of the simulation");
        return fmi2Error;
    }
    d->phase = ENDED;
    return fmi2OK;
}
API fmi2Status fmi2Reset(fmi2Component c) {
    ALIVE(c);
    to_start(&((Part *)c)->data);
    return fmi2OK;
}

static int is_known(Part *part, fmi2ValueReference r, int type) {
    if (r < VARIABLES && VARIABLE[r].type == type) return 1;
    complain(part, "the value reference must be that of %s, but is %u", type == FLOAT ? "a Real" : "an Integer", r);
    return 0;
}

#define GET_AND_SET(NAME, TYPE, KIND)                                                                              \
    API fmi2Status fmi2Get##NAME(fmi2Component c, const fmi2ValueReference r[], size_t n, TYPE x[]) {              \
        ALIVE(c);                                                                                                  \
        if (n && (!r || !x)) return fmi2Error;                                                                     \
        for (size_t k = 0; k < n; k++) {                                                                           \
            if (!is_known(c, r[k], KIND)) return fmi2Error;                                                        \
            x[k] = (TYPE)value_of(c, (int)r[k]);                                                                   \
        }                                                                                                          \
        return fmi2OK;                                                                                             \
    }                                                                                                              \
    API fmi2Status fmi2Set##NAME(fmi2Component c, const fmi2ValueReference r[], size_t n, const TYPE x[]) {        \
        ALIVE(c);                                                                                                  \
        if (n && (!r || !x)) return fmi2Error;                                                                     \
        int worst = FINE;                                                                                          \
        for (size_t k = 0; k < n; k++) {                                                                           \
            if (!is_known(c, r[k], KIND)) return fmi2Error;                                                        \
            int how = set_value(c, (int)r[k], (double)x[k]);                                                       \
            worst = how > worst ? how : worst;                                                                     \
        }                                                                                                          \
        return STATUS[worst];                                                                                      \
    }
GET_AND_SET(Real, fmi2Real, FLOAT)
GET_AND_SET(Integer, fmi2Integer, INTEGER)

#define NONE_OF(NAME, TYPE)                                                                                        \
    API fmi2Status fmi2Get##NAME(fmi2Component c, const fmi2ValueReference r[], size_t n, TYPE x[]) {              \
        return n ? fmi2Error : fmi2OK;                                                                             \
    }                                                                                                              \
    API fmi2Status fmi2Set##NAME(fmi2Component c, const fmi2ValueReference r[], size_t n, const TYPE x[]) {        \
        return n ? fmi2Error : fmi2OK;                                                                             \
    }
NONE_OF(Boolean, fmi2Boolean)
NONE_OF(String, fmi2String)

API fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    ALIVE(c);
    if (!state) return fmi2Error;
    if (!*state) *state = malloc(sizeof(Data));
    if (!*state) return fmi2Error;
    memcpy(*state, &((Part *)c)->data, sizeof(Data));
    return fmi2OK;
}
API fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    ALIVE(c);
    if (!is_own(c, state, sizeof(Data))) return fmi2Error;
    restore(c, state);
    return fmi2OK;
}
API fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (state) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}
API fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    if (!size) return fmi2Error;
    *size = sizeof(Data);
    return fmi2OK;
}
API fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    if (!state || !bytes || size < sizeof(Data)) return fmi2Error;
    memcpy(bytes, state, sizeof(Data));
    return fmi2OK;
}
API fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    ALIVE(c);
    if (!state || !is_own(c, bytes, size)) return fmi2Error;
    if (!*state) *state = malloc(sizeof(Data));
    if (!*state) return fmi2Error;
    memcpy(*state, bytes, sizeof(Data));
    return fmi2OK;
}

API fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[], size_t n,
                                            const fmi2ValueReference k[], size_t m, const fmi2Real dk[], fmi2Real du[]) {
    return fmi2Error;
}
API fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                           const fmi2Integer order[], const fmi2Real x[]) {
    ALIVE(c);
    if (n && (!r || !order || !x)) return fmi2Error;
    Data *d = &((Part *)c)->data;
    for (size_t k = 0; k < n; k++) {
        if (V_BASE < 0 || r[k] != V_BASE || order[k] != 1) return fmi2Error;
        if (!(fabs(x[k]) <= VARIABLE[V_BASE < 0 ? 0 : V_BASE].most)) return fmi2Discard;
        d->slope = x[k];
    }
    return fmi2OK;
}
API fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                            const fmi2Integer order[], fmi2Real x[]) {
    return n ? fmi2Error : fmi2OK;
}

API fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_return) {
    ALIVE(c);
    Part *part = c;
    if (part->data.phase != RUNNING) {
        complain(part, "the initialisation must be over before a step");
        return fmi2Error;
    }
    return step(part, t, h, 0) == FAILED ? fmi2Error : fmi2OK;
}
API fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }
API fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *x) { return fmi2Discard; }
API fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *x) {
    ALIVE(c);
    if (kind != fmi2LastSuccessfulTime || !x) return fmi2Discard;
    *x = ((Part *)c)->data.time;
    return fmi2OK;
}
API fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *x) { return fmi2Discard; }
API fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *x) {
    if (kind != fmi2Terminated || !x) return fmi2Discard;
    *x = 0;
    return fmi2OK;
}
API fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *x) { return fmi2Discard; }
