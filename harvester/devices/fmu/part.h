/* A device as a part of a functional mock-up unit: the common part of the interfaces FMI 2.0 and 3.0.

   The physics is in harvester_part, which is compiled from the package's own kernels; here are only the bookkeeping of
   variables, units, states and times.  model.h is written for each scene. */

#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BEGIN, ADVANCE, STOPPING, JUMP, READ };                /* harvester/mechanics/part/part_state.py */
enum { DONE, EVENT, FAILED, UNSOLVED };
enum { PARAMETER, TUNABLE, INPUT, OUTPUT, TIME };             /* kinds of variables */
enum { CREATED, INITIALISING, RUNNING, AT_EVENT, ENDED };     /* phases of an instance */
enum { FLOAT, INTEGER };
#define MOST_STEPS 1e9 /* inner ones in a communication step: some minutes */

typedef struct {
    const char *name;
    int kind, type;
    double start, least, most;
    int output, unit; /* of an output: its place in the report of READ, and the number that is its unit */
} Variable;

/* A number of the compiled part is `base` times the product of (variable/start)^power over its terms. */
typedef struct { int number, variable; double power; } Term;

#include "model.h"

long long harvester_part(long long what, double *numbers, double *w, uint64_t *words, int64_t *at, double *out, double until);

typedef struct { /* the whole state, as it is saved and restored */
    char token[sizeof TOKEN]; /* first: of another FMU the size of a state is unknown */
    double v[VARIABLES];
    double numbers[NUMBERS];
    double w[STATE_SIZE];
    double out[OUT_SIZE];
    uint64_t words[2];
    double time, origin, slope; /* slope of the base's acceleration in the coming step */
    int phase, stale;
} Data;

typedef struct Part {
    Data data;
    void *environment;
    void (*say)(struct Part *part, const char *words);
    void *logger;
    char *name;
    int events, early, alive;
    struct Part *next;
#if NETLIST
    double room[ROOM_SIZE], aside[NETLIST_SIZE]; /* no part of the state */
#endif
} Part;

/* Call the compiled part; a netlist inside works on the tables of model.h. */
static int call(Part *part, int what, double until) {
    Data *d = &part->data;
#if NETLIST
    Circuit circuit = CIRCUIT_RECORD;
    circuit.charge = d->numbers[N_CHARGE];
    int64_t at[] = {(intptr_t)&circuit, (intptr_t)harvester_follow, (intptr_t)part->room, (intptr_t)part->aside};
#else
    int64_t at[] = {0};
#endif
    return (int)harvester_part(what, d->numbers, d->w, d->words, at, d->out, until);
}

/* The first state of a netlist inside. */
static void begin_netlist(Data *d) {
#if NETLIST
    double *circuit = d->w + NETLIST_AT;
    memcpy(circuit, of_rest, NETLIST_SIZE * sizeof *circuit);
    circuit[PIEZO_AT] = d->v[V_VOLTAGE] / PIEZO_VOLTS;
    circuit[VOLTAGES_AT] = d->v[V_VOLTAGE];
    if (LOAD_AT_PIEZO != 0.0) circuit[VOLTAGES_AT + 2] = LOAD_AT_PIEZO * d->v[V_VOLTAGE];
    if (V_STORE >= 0) {
        circuit[CSMOOTH_AT < 0 ? 0 : CSMOOTH_AT] = d->v[V_STORE < 0 ? 0 : V_STORE] / CSMOOTH_VOLTS;
        circuit[VOLTAGES_AT + 1] = d->v[V_STORE < 0 ? 0 : V_STORE];
        if (LOAD_AT_CSMOOTH != 0.0) circuit[VOLTAGES_AT + 2] = LOAD_AT_CSMOOTH * circuit[VOLTAGES_AT + 1];
    }
#endif
}

/* The element of a netlist whose equations were not solved last, of which the solver returned the number. */
static const char *unsolved(const Data *d) {
#if NETLIST
    int k = (int)(-2.0 - d->w[NETLIST_AT + NETLIST_SIZE - 1]);
    if (k >= 0 && k < FUNCTIONS) return ELEMENT[k];
#endif
    return "its elements";
}

static void complain(Part *part, const char *format, ...) {
    char words[400];
    va_list rest;
    va_start(rest, format);
    vsnprintf(words, sizeof words, format, rest);
    va_end(rest);
    if (part->say) part->say(part, words);
}

static int is_count(double x) { return x >= 0.0 && x <= 9007199254740992.0 && x == floor(x); }
static int is_one_of(double x, double least, double most) { return x >= least && x <= most && x == floor(x); }
static int are_finite(const double *x, int n) { /* and so are their squares */
    for (int k = 0; k < n; k++)
        if (!(fabs(x[k]) < 1e150)) return 0;
    return 1;
}

static void numbers_of(Data *d) {
    for (int k = 0; k < NUMBERS; k++) d->numbers[k] = BASE[k];
    for (int k = 0; k < TERMS_COUNT; k++) {
        const Term *t = TERMS + k;
        if (MODEL) { /* a number of a user's model may be 0, and is the variable itself */
            d->numbers[t->number] = d->v[t->variable];
            continue;
        }
        double ratio = d->v[t->variable] / VARIABLE[t->variable].start;
        if (ratio != 1.0) d->numbers[t->number] *= pow(ratio, t->power);
    }
}

/* Numbers of the present actions: inputs, which are constant or linear in time from now on. */
static void inputs(Data *d) {
#if MODEL
    if (N_CURRENT >= 0) d->numbers[N_CURRENT] = d->v[V_CURRENT];
#else
    double since = (d->time - d->origin) * FREQUENCY;
    d->numbers[N_A] = -d->v[V_BASE] / d->numbers[N_ACCELERATION];
    d->numbers[N_SLOPE] = -d->slope / d->numbers[N_ACCELERATION] / FREQUENCY;
    d->numbers[N_SINCE] = since;
    if (N_CURRENT >= 0) d->numbers[N_CURRENT] = d->v[V_CURRENT < 0 ? 0 : V_CURRENT] / d->numbers[N_AMPERES];
#endif
}

/* What is wrong with the numbers of a state, which may have been changed while it was saved; NULL if nothing is. */
static const char *fault_of(const Data *d) {
    if (d->phase < CREATED || d->phase > ENDED) return "phase";
    if (!are_finite(d->v, VARIABLES)) return "variables";
    for (int k = 0; k < VARIABLES; k++) {
        const Variable *v = VARIABLE + k;
        if (v->kind != OUTPUT && v->kind != TIME && !(d->v[k] >= v->least && d->v[k] <= v->most)) return v->name;
    }
    if (!isfinite(d->time) || !isfinite(d->origin) || !(fabs(d->slope) < 1e150) || d->time < d->origin) return "time";
    if (!are_finite(d->w, STATE_SIZE)) return "motion";
    double now = (d->time - d->origin) * FREQUENCY, slack = 1e-6 * (now + INNER_STEP);
    if (!(fabs(d->w[LOCATED ? W_TIME : W_NOW] - now) <= slack)) return "time of the motion";
    if (!LOCATED && !(fabs(d->w[W_TIME] - d->w[W_STEPS] * INNER_STEP) <= slack && d->w[W_TIME] <= now + slack &&
                      d->w[W_TIME] >= now - INNER_STEP - slack))
        return "time of the last inner step";
    if (!is_count(d->w[W_STEPS]) || !is_count(d->w[W_HITS])) return "counts";
    if (!is_one_of(d->w[W_BEGUN], 0.0, 1.0) || !is_one_of(d->w[W_PENDING], -1.0, 1.0)) return "marks of the motion";
#if NETLIST
    const double *circuit = d->w + NETLIST_AT;
    for (int k = 0; k < SWITCHES; k++)
        if (!is_one_of(circuit[SWITCHES_AT + k], 0.0, 1.0)) return "switches";
    if (!is_one_of(circuit[VOLTAGES_AT - 1], 0.0, LEVELS - 1)) return "level of the circuit's steps";
    if (!(d->w[W_COUNTS] >= 0.0) || !is_count(d->w[W_COUNTS + 1]) || !is_count(d->w[W_COUNTS + 2])) return "counts of the circuit";
#endif
    if (d->phase == CREATED || d->phase == INITIALISING) return NULL; /* the first numbers are made at the end of it */
    if (!(d->words[0] | d->words[1])) return "random generator";
    Data again = *d;
    numbers_of(&again);
    for (int k = 0; k < NUMBERS; k++) {
        int given = k == N_A || k == N_SLOPE || k == N_SINCE || k == N_CURRENT; /* those of the step before */
        if (!given && again.numbers[k] != d->numbers[k]) return "numbers of the device";
    }
    return NULL;
}

/* Whether bytes are a state that this FMU has saved, to whose tables it belongs; with words if not. */
static int is_own(Part *part, const void *bytes, size_t size) {
    if (!bytes || size != sizeof(Data) || memcmp(bytes, TOKEN, sizeof TOKEN)) {
        complain(part, "the state must be one of this FMU, but is of another");
        return 0;
    }
    Data d;
    memcpy(&d, bytes, sizeof d);
    const char *fault = fault_of(&d);
    if (fault) complain(part, "the state must be as it was saved, but has another value in its %s", fault);
    return !fault;
}

/* Put a state in place of the present one. */
static void restore(Part *part, const void *state) {
    memcpy(&part->data, state, sizeof(Data));
    part->data.stale = 1; /* outputs are computed from it */
}

static uint64_t split_mix(uint64_t *z) { /* Steele, Lea and Flood 2014: words for the generator from a seed */
    uint64_t x = (*z += 0x9e3779b97f4a7c15u);
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

static void to_start(Data *d) {
    memset(d, 0, sizeof *d);
    memcpy(d->token, TOKEN, sizeof TOKEN);
    for (int k = 0; k < VARIABLES; k++) d->v[k] = VARIABLE[k].start;
    d->phase = CREATED;
    d->stale = 1;
    numbers_of(d);
}

#if !MODEL
/* The faster of resonance and drive: the frequency (rad/s over FREQUENCY) that the inner step must resolve. */
static double fastest(const double *numbers) {
    double square = fabs(numbers[N_LINEAR]) + (N_BETA < 0 ? 0.0 : numbers[N_BETA < 0 ? 0 : N_BETA]);
    return fmax(sqrt(square), N_DRIVE_FREQUENCY < 0 ? 0.0 : numbers[N_DRIVE_FREQUENCY < 0 ? 0 : N_DRIVE_FREQUENCY]);
}

/* The first motion of a device; 0 with words, if there is none. */
static int begin_device(Part *part) {
    Data *d = &part->data;
    d->w[W_X] = d->v[V_DISPLACEMENT] / d->numbers[N_LENGTH];
    d->w[W_SPEED] = d->v[V_VELOCITY] / d->numbers[N_SPEED];
    d->w[W_VOLTAGE] = d->v[V_VOLTAGE] / d->numbers[N_VOLTS];
    d->w[W_STORE] = V_STORE < 0 ? 0.0 : d->v[V_STORE < 0 ? 0 : V_STORE] / d->numbers[N_VOLTS];
    d->w[W_FOLLOWER] = d->w[W_X];
    double low = N_LOW < 0 ? -INFINITY : d->numbers[N_LOW], high = N_HIGH < 0 ? INFINITY : d->numbers[N_HIGH];
    double slack = 1e-12 * (fabs(d->w[W_X]) + 1.0);
    if (d->w[W_X] < low - slack || d->w[W_X] > high + slack) {
        complain(part, "%s must be between the stops, from %g to %g m, but is %g m", VARIABLE[V_DISPLACEMENT].name,
                 low * d->numbers[N_LENGTH], high * d->numbers[N_LENGTH], d->v[V_DISPLACEMENT]);
        return 0;
    }
    d->w[W_X] = fmin(fmax(d->w[W_X], low), high);
    if (fastest(d->numbers) > FASTEST) {
        complain(part, "the parameters must keep resonance and drive below %g Hz, for the inner step is fixed, but give "
                 "%g Hz: export the scene with these values", FASTEST * FREQUENCY / 6.283185307179586,
                 fastest(d->numbers) * FREQUENCY / 6.283185307179586);
        return 0;
    }
    return 1;
}
#else
/* The first state of a user's model, the piezo's voltage with it. */
static int begin_device(Part *part) {
    Data *d = &part->data;
    for (int k = 0; k < MODEL_STATES; k++) d->w[MODEL_AT + k] = d->v[V_STATE + k];
    d->w[W_VOLTAGE] = V_VOLTAGE < 0 ? 0.0 : d->v[V_VOLTAGE < 0 ? 0 : V_VOLTAGE];
    return 1;
}
#endif

/* The first state of the parameters; 0 with words, if there is none. */
static int begin(Part *part) {
    Data *d = &part->data;
    numbers_of(d);
    memset(d->w, 0, sizeof d->w);
    begin_netlist(d);
    uint64_t z = V_SEED < 0 ? 0 : (uint64_t)(int64_t)d->v[V_SEED];
    d->words[0] = split_mix(&z) | 1;
    d->words[1] = split_mix(&z);
    d->stale = 1;
    return begin_device(part);
}

static void refresh(Part *part) {
    Data *d = &part->data;
    if (!d->stale) return;
    if (d->phase == INITIALISING || d->phase == CREATED) begin(part);
    inputs(d);
    call(part, READ, 0.0);
    d->stale = 0;
}

static double value_of(Part *part, int k) {
    Data *d = &part->data;
    const Variable *v = VARIABLE + k;
    if (v->kind == TIME) return d->time;
    if (v->kind != OUTPUT) return d->v[k];
    refresh(part);
    double shift = v->output == OUT_IMPACT_TIME && d->out[OUT_IMPACTS] > 0.0 ? d->origin : 0.0;
    return d->out[v->output] * (v->unit < 0 ? 1.0 : d->numbers[v->unit]) + shift;
}

enum { FINE, REFUSED, WRONG }; /* taken; a value out of range; not to be set now */

static int set_value(Part *part, int k, double x) {
    Data *d = &part->data;
    const Variable *v = VARIABLE + k;
    if (v->kind == OUTPUT || v->kind == TIME) {
        complain(part, "%s must be left to the model, for it is an output", v->name);
        return WRONG;
    }
    if (v->kind == PARAMETER && d->phase != CREATED && d->phase != INITIALISING) {
        complain(part, "%s must be set before the end of the initialisation, for it is fixed then", v->name);
        return WRONG;
    }
    if (d->phase == ENDED) {
        complain(part, "%s must be set before the end of the simulation", v->name);
        return WRONG;
    }
    if (!(x >= v->least && x <= v->most)) {
        complain(part, "%s must be between %g and %g, but is %g", v->name, v->least, v->most, x);
        return REFUSED;
    }
    if (d->v[k] == x) return FINE;
    d->v[k] = x;
    d->stale = 1;
    if (d->phase == RUNNING || d->phase == AT_EVENT) numbers_of(d);
    return FINE;
}

/* Advance by a step to t + h; `stop`: to the next impact, if that is earlier. DONE, EVENT or FAILED, with words. */
static int step(Part *part, double t, double h, int stop) {
    Data *d = &part->data;
    if (!(h > 0.0) || !isfinite(h)) {
        complain(part, "the communication step must be above 0 s and finite, but is %g s", h);
        return FAILED;
    }
    if (!isfinite(t) || t + h == t) {
        complain(part, "the communication point must be a time that a step of %g s changes, but is %g s", h, t);
        return FAILED;
    }
    if (h * FREQUENCY > MOST_STEPS * INNER_STEP) {
        complain(part, "the communication step must be at most %g s, but is %g s", MOST_STEPS * INNER_STEP / FREQUENCY, h);
        return FAILED;
    }
    if (!(fabs(t - d->time) <= 1e-9 * (fabs(t) + h))) {
        complain(part, "the communication point must be %.17g s, where the last step ended, but is %.17g s", d->time, t);
        return FAILED;
    }
    inputs(d);
    double until = (t + h - d->origin) * FREQUENCY;
    int answer = call(part, stop ? STOPPING : ADVANCE, until);
    d->stale = 1;
    if (answer != EVENT) d->slope = 0.0;
    if (answer == FAILED) {
        complain(part, MODEL ? "the model's functions must give finite numbers, and event a time within the drift, at most 100 in a step, but by %g s do not"
                             : "the motion must stay finite, but has grown without bound by %g s: see the damping", t + h);
        return FAILED;
    }
    if (answer == UNSOLVED) {
        complain(part, "the netlist must have a solution at each step, but by %g s too many fail, the last at %s", t + h, unsolved(d));
        return FAILED;
    }
    d->time = answer == EVENT ? d->origin + d->w[LOCATED ? W_TIME : W_NOW] / FREQUENCY : t + h;
    return answer;
}

#include "instances.h"
