"""A library that a program loads before the system's: its disk is full or slow, its clock jumps, it gets no threads.

The disk is full after ROOM bytes, and each write to a file takes DELAY ms; the clock of the day
jumps by JUMP s at the LOOKS-th look; after THREADS threads and processes the system starts no more,
as after `ulimit -u`, which does not bind root.  After `arm(writes, allocations)` the writes-th
write to a file and the allocations-th allocation of at least SMALLEST bytes fail, once each.
"""

import subprocess

SOURCE = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static long number(const char *name, long otherwise) {
    const char *text = getenv(name);
    return text ? atol(text) : otherwise;
}

#define SMALLEST 1024

static long writes_left, allocations_left;

void arm(long writes, long allocations) {
    writes_left = writes;
    allocations_left = allocations;
}

static int is_this_one(long *left) {
    return *left > 0 && __sync_sub_and_fetch(left, 1) == 0;
}

extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);
extern void *__libc_realloc(void *, size_t);

static int refused(size_t bytes) {
    if (bytes < SMALLEST || !is_this_one(&allocations_left)) return 0;
    errno = ENOMEM;
    return 1;
}

void *malloc(size_t bytes) {
    return refused(bytes) ? NULL : __libc_malloc(bytes);
}

void *calloc(size_t count, size_t bytes) {
    return refused(count * bytes) ? NULL : __libc_calloc(count, bytes);
}

void *realloc(void *old, size_t bytes) {
    return refused(bytes) ? NULL : __libc_realloc(old, bytes);
}

static int full(int file, size_t bytes) {
    static long room = -2;
    struct stat state;
    if (room == -2) room = number("ROOM", -1);
    if (fstat(file, &state) || !S_ISREG(state.st_mode)) return 0;
    if (file > 2 && is_this_one(&writes_left)) { errno = ENOSPC; return 1; }
    usleep(1000 * number("DELAY", 0));
    if (room == -1) return 0;
    if ((long)bytes > room) { room = 0; errno = ENOSPC; return 1; }
    room -= bytes;
    return 0;
}

ssize_t write(int file, const void *data, size_t bytes) {
    static ssize_t (*real)(int, const void *, size_t);
    if (!real) real = dlsym(RTLD_NEXT, "write");
    return full(file, bytes) ? -1 : real(file, data, bytes);
}

ssize_t pwrite64(int file, const void *data, size_t bytes, off64_t place) {
    static ssize_t (*real)(int, const void *, size_t, off64_t);
    if (!real) real = dlsym(RTLD_NEXT, "pwrite64");
    return full(file, bytes) ? -1 : real(file, data, bytes, place);
}

static int spent(void) {
    static long started;
    long most = number("THREADS", -1);
    return most >= 0 && __sync_add_and_fetch(&started, 1) > most;
}

int pthread_create(pthread_t *thread, const pthread_attr_t *how, void *(*run)(void *), void *given) {
    static int (*real)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
    if (!real) real = dlsym(RTLD_NEXT, "pthread_create");
    return spent() ? EAGAIN : real(thread, how, run, given);
}

pid_t fork(void) {
    static pid_t (*real)(void);
    if (!real) real = dlsym(RTLD_NEXT, "fork");
    if (spent()) { errno = EAGAIN; return -1; }
    return real();
}

pid_t vfork(void) {
    return fork();  /* what returns twice cannot be wrapped */
}

int clock_gettime(clockid_t clock, struct timespec *now) {
    static int (*real)(clockid_t, struct timespec *);
    static long looks = -1, seen;
    if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
    if (looks == -1) looks = number("LOOKS", 0);
    int failed = real(clock, now);
    if (looks && clock == CLOCK_REALTIME && ++seen >= looks) now->tv_sec += number("JUMP", 0);
    return failed;
}
"""


def built(folder):
    """The path of the library, compiled there by `cc`."""
    source, library = folder / "shim.c", folder / "shim.so"
    source.write_text(SOURCE)
    subprocess.run(
        ["cc", "-shared", "-fPIC", "-O1", "-o", library, source, "-ldl"],
        check=True,
        capture_output=True,
    )
    return str(library)
