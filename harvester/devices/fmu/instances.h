/* Instances of a unit.  Memory of freed ones is kept for later ones, so that a call on a freed one has a status. */

static Part *resting; /* freed instances, linked by `next` */
static char busy;     /* the list's lock */

static void locked(void) {
    while (__atomic_test_and_set(&busy, __ATOMIC_ACQUIRE)) {}
}
static void unlocked(void) { __atomic_clear(&busy, __ATOMIC_RELEASE); }

/* Whether an instance can be called: it is neither NULL nor freed. */
static int is_alive(const Part *part) { return part && __atomic_load_n(&part->alive, __ATOMIC_ACQUIRE); }

static Part *made(const char *name) {
    char *own = malloc(strlen(name ? name : "") + 1);
    if (!own) return NULL;
    strcpy(own, name ? name : "");
    locked();
    Part *part = resting;
    if (part) resting = part->next;
    unlocked();
    if (!part) part = calloc(1, sizeof *part);
    if (!part) {
        free(own);
        return NULL;
    }
    memset(part, 0, sizeof *part);
    part->name = own;
    to_start(&part->data);
    __atomic_store_n(&part->alive, 1, __ATOMIC_RELEASE);
    return part;
}

static void unmade(Part *part) {
    if (!part || !__atomic_exchange_n(&part->alive, 0, __ATOMIC_ACQ_REL)) return;
    free(part->name);
    part->name = NULL;
    locked();
    part->next = resting;
    resting = part;
    unlocked();
}

/* At the end of the library. */
static __attribute__((destructor)) void emptied(void) {
    while (resting) {
        Part *part = resting;
        resting = part->next;
        free(part);
    }
}
