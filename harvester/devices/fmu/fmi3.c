/* The interface FMI 3.0 for co-simulation (fmi-standard.org); types and functions as that standard has them.

   With event mode an impact ends the step early, if the importer allows that: it jumps in fmi3UpdateDiscreteStates. */

#include <stdbool.h>

#include "part.h"

#if defined(_WIN32)
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif

typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8, fmi3Byte;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char *fmi3String;
typedef const fmi3Byte *fmi3Binary;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum { fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent } fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean *, fmi3Float64 *);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3UnlockPreemptionCallback)(void);

/* The first line of a function: an instance that is NULL or was freed has a status. */
#define ALIVE(c) \
    if (!is_alive(c)) return fmi3Error

static const fmi3Status STATUS[] = {fmi3OK, fmi3Discard, fmi3Error};

static void say(Part *part, const char *words) {
    if (part->logger) ((fmi3LogMessageCallback)part->logger)(part->environment, fmi3Error, "logStatusError", words);
}

API const char *fmi3GetVersion(void) { return "3.0"; }
API fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) { return fmi3OK; }

API fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                             fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                             const fmi3ValueReference r[], size_t n, fmi3InstanceEnvironment environment,
                                             fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    if (!token || strcmp(token, TOKEN) || n > 0) {
        if (log)
            log(environment, fmi3Error, "logStatusError",
                n > 0 ? "there must be no intermediate variables" : "the token must be that of modelDescription.xml");
        return NULL;
    }
    Part *part = made(name);
    if (!part) return NULL;
    part->environment = environment;
    part->logger = (void *)log;
    part->say = say;
    part->events = events;
    part->early = early;
    return part;
}
API fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                              fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                              fmi3LogMessageCallback log) {
    return NULL;
}
API fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                                   fmi3Boolean visible, fmi3Boolean logging,
                                                   fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                                   fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
                                                   fmi3UnlockPreemptionCallback unlock) {
    return NULL;
}
API void fmi3FreeInstance(fmi3Instance c) { unmade(c); }

static fmi3Status changed(fmi3Instance c, int from, int to) {
    ALIVE(c);
    Data *d = &((Part *)c)->data;
    if (d->phase != from) {
        complain(c, "the instance must be in another mode for this call");
        return fmi3Error;
    }
    d->phase = to;
    return fmi3OK;
}
API fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean t, fmi3Float64 tolerance, fmi3Float64 start,
                                           fmi3Boolean s, fmi3Float64 stop) {
    ALIVE(c);
    Data *d = &((Part *)c)->data;
    if (!isfinite(start) || changed(c, CREATED, INITIALISING) != fmi3OK) return fmi3Error;
    d->time = d->origin = start;
    d->stale = 1;
    return fmi3OK;
}
API fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    ALIVE(c);
    Part *part = c;
    if (part->data.phase != INITIALISING || !begin(part)) return fmi3Error;
    part->data.phase = part->events ? AT_EVENT : RUNNING;
    return fmi3OK;
}
API fmi3Status fmi3EnterEventMode(fmi3Instance c) {
    ALIVE(c);
    if (!((Part *)c)->events) {
        complain(c, "the instance must be made with event mode for this call");
        return fmi3Error;
    }
    return changed(c, RUNNING, AT_EVENT);
}
API fmi3Status fmi3EnterStepMode(fmi3Instance c) { return changed(c, AT_EVENT, RUNNING); }
API fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                        fmi3Boolean *values, fmi3Boolean *next, fmi3Float64 *time) {
    ALIVE(c);
    if (!again || !terminate || !nominals || !values || !next) return fmi3Error;
    Data *d = &((Part *)c)->data;
    *again = *terminate = *nominals = *next = *values = false;
    if (changed(c, AT_EVENT, AT_EVENT) != fmi3OK) return fmi3Error;
    *values = d->w[W_PENDING] != 0.0;
    inputs(d);
    call(c, JUMP, 0.0);
    d->stale = 1;
    return fmi3OK;
}
API fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) {
    ALIVE(c);
    int phase = ((Part *)c)->data.phase;
    return phase == INITIALISING || phase == AT_EVENT ? fmi3OK : fmi3Error;
}
API fmi3Status fmi3Terminate(fmi3Instance c) {
    ALIVE(c);
    return changed(c, ((Part *)c)->data.phase == AT_EVENT ? AT_EVENT : RUNNING, ENDED);
}
API fmi3Status fmi3Reset(fmi3Instance c) {
    ALIVE(c);
    to_start(&((Part *)c)->data);
    return fmi3OK;
}

API fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_return, fmi3Boolean *event,
                          fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
    ALIVE(c);
    if (!event || !terminate || !early || !last) return fmi3Error;
    Part *part = c;
    *event = *terminate = *early = false;
    if (part->data.phase != RUNNING) {
        complain(part, "the instance must be in step mode for a step");
        return fmi3Error;
    }
    int answer = step(part, t, h, part->events && part->early);
    *last = part->data.time;
    *event = *early = answer == EVENT;
    return answer == FAILED ? fmi3Error : fmi3OK;
}

static int is_known(Part *part, fmi3ValueReference r, int type) {
    if (r < VARIABLES && VARIABLE[r].type == type) return 1;
    complain(part, "the value reference must be that of %s, but is %u", type == FLOAT ? "a Float64" : "an Int32", r);
    return 0;
}

#define GET_AND_SET(NAME, TYPE, KIND)                                                                              \
    API fmi3Status fmi3Get##NAME(fmi3Instance c, const fmi3ValueReference r[], size_t n, TYPE x[], size_t m) {     \
        ALIVE(c);                                                                                                  \
        if (n != m || (n && (!r || !x))) return fmi3Error;                                                         \
        for (size_t k = 0; k < n; k++) {                                                                           \
            if (!is_known(c, r[k], KIND)) return fmi3Error;                                                        \
            x[k] = (TYPE)value_of(c, (int)r[k]);                                                                   \
        }                                                                                                          \
        return fmi3OK;                                                                                             \
    }                                                                                                              \
    API fmi3Status fmi3Set##NAME(fmi3Instance c, const fmi3ValueReference r[], size_t n, const TYPE x[],           \
                                 size_t m) {                                                                       \
        int worst = FINE;                                                                                          \
        ALIVE(c);                                                                                                  \
        if (n != m || (n && (!r || !x))) return fmi3Error;                                                         \
        for (size_t k = 0; k < n; k++) {                                                                           \
            if (!is_known(c, r[k], KIND)) return fmi3Error;                                                        \
            int how = set_value(c, (int)r[k], (double)x[k]);                                                       \
            worst = how > worst ? how : worst;                                                                     \
        }                                                                                                          \
        return STATUS[worst];                                                                                      \
    }
GET_AND_SET(Float64, fmi3Float64, FLOAT)
GET_AND_SET(Int32, fmi3Int32, INTEGER)

#define NONE_OF(NAME, TYPE)                                                                                        \
    API fmi3Status fmi3Get##NAME(fmi3Instance c, const fmi3ValueReference r[], size_t n, TYPE x[], size_t m) {     \
        return n ? fmi3Error : fmi3OK;                                                                             \
    }                                                                                                              \
    API fmi3Status fmi3Set##NAME(fmi3Instance c, const fmi3ValueReference r[], size_t n, const TYPE x[],           \
                                 size_t m) {                                                                       \
        return n ? fmi3Error : fmi3OK;                                                                             \
    }
NONE_OF(Float32, fmi3Float32)
NONE_OF(Int8, fmi3Int8)
NONE_OF(UInt8, fmi3UInt8)
NONE_OF(Int16, fmi3Int16)
NONE_OF(UInt16, fmi3UInt16)
NONE_OF(UInt32, fmi3UInt32)
NONE_OF(Int64, fmi3Int64)
NONE_OF(UInt64, fmi3UInt64)
NONE_OF(Boolean, fmi3Boolean)
NONE_OF(String, fmi3String)
API fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference r[], size_t n, size_t sizes[], fmi3Binary x[], size_t m) {
    return n ? fmi3Error : fmi3OK;
}
API fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference r[], size_t n, const size_t sizes[],
                             const fmi3Binary x[], size_t m) {
    return n ? fmi3Error : fmi3OK;
}
API fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Clock x[]) {
    return n ? fmi3Error : fmi3OK;
}
API fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Clock x[]) {
    return n ? fmi3Error : fmi3OK;
}

API fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    ALIVE(c);
    if (!state) return fmi3Error;
    if (!*state) *state = malloc(sizeof(Data));
    if (!*state) return fmi3Error;
    memcpy(*state, &((Part *)c)->data, sizeof(Data));
    return fmi3OK;
}
API fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    ALIVE(c);
    if (!is_own(c, state, sizeof(Data))) return fmi3Error;
    restore(c, state);
    return fmi3OK;
}
API fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    if (state) {
        free(*state);
        *state = NULL;
    }
    return fmi3OK;
}
API fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
    if (!size) return fmi3Error;
    *size = sizeof(Data);
    return fmi3OK;
}
API fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    if (!state || !bytes || size < sizeof(Data)) return fmi3Error;
    memcpy(bytes, state, sizeof(Data));
    return fmi3OK;
}
API fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
    ALIVE(c);
    if (!state || !is_own(c, bytes, size)) return fmi3Error;
    if (!*state) *state = malloc(sizeof(Data));
    if (!*state) return fmi3Error;
    memcpy(*state, bytes, sizeof(Data));
    return fmi3OK;
}

/* Functions that this kind of unit lacks. */
#define REFUSE(NAME, ...) \
    API fmi3Status fmi3##NAME(fmi3Instance c, __VA_ARGS__) { return fmi3Error; }
#define REFUSE_ALONE(NAME) \
    API fmi3Status fmi3##NAME(fmi3Instance c) { return fmi3Error; }
REFUSE(GetNumberOfVariableDependencies, fmi3ValueReference r, size_t *n)
REFUSE(GetVariableDependencies, fmi3ValueReference r, size_t of[], fmi3ValueReference on[], size_t at[], fmi3DependencyKind k[], size_t n)
REFUSE(GetDirectionalDerivative, const fmi3ValueReference u[], size_t n, const fmi3ValueReference k[], size_t m, const fmi3Float64 s[], size_t p, fmi3Float64 x[], size_t q)
REFUSE(GetAdjointDerivative, const fmi3ValueReference u[], size_t n, const fmi3ValueReference k[], size_t m, const fmi3Float64 s[], size_t p, fmi3Float64 x[], size_t q)
REFUSE_ALONE(EnterConfigurationMode)
REFUSE_ALONE(ExitConfigurationMode)
REFUSE(GetIntervalDecimal, const fmi3ValueReference r[], size_t n, fmi3Float64 x[], fmi3IntervalQualifier q[])
REFUSE(GetIntervalFraction, const fmi3ValueReference r[], size_t n, fmi3UInt64 x[], fmi3UInt64 y[], fmi3IntervalQualifier q[])
REFUSE(GetShiftDecimal, const fmi3ValueReference r[], size_t n, fmi3Float64 x[])
REFUSE(GetShiftFraction, const fmi3ValueReference r[], size_t n, fmi3UInt64 x[], fmi3UInt64 y[])
REFUSE(SetIntervalDecimal, const fmi3ValueReference r[], size_t n, const fmi3Float64 x[])
REFUSE(SetIntervalFraction, const fmi3ValueReference r[], size_t n, const fmi3UInt64 x[], const fmi3UInt64 y[])
REFUSE(SetShiftDecimal, const fmi3ValueReference r[], size_t n, const fmi3Float64 x[])
REFUSE(SetShiftFraction, const fmi3ValueReference r[], size_t n, const fmi3UInt64 x[], const fmi3UInt64 y[])
REFUSE_ALONE(EnterContinuousTimeMode)
REFUSE(CompletedIntegratorStep, fmi3Boolean no, fmi3Boolean *event, fmi3Boolean *terminate)
REFUSE(SetTime, fmi3Float64 t)
REFUSE(SetContinuousStates, const fmi3Float64 x[], size_t n)
REFUSE(GetContinuousStateDerivatives, fmi3Float64 x[], size_t n)
REFUSE(GetEventIndicators, fmi3Float64 x[], size_t n)
REFUSE(GetContinuousStates, fmi3Float64 x[], size_t n)
REFUSE(GetNominalsOfContinuousStates, fmi3Float64 x[], size_t n)
REFUSE(GetNumberOfEventIndicators, size_t *n)
REFUSE(GetNumberOfContinuousStates, size_t *n)
REFUSE(GetOutputDerivatives, const fmi3ValueReference r[], size_t n, const fmi3Int32 order[], fmi3Float64 x[], size_t m)
REFUSE(ActivateModelPartition, fmi3ValueReference r, fmi3Float64 t)
