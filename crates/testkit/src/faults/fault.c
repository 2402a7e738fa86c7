/* A layer between a program and the C library (LD_PRELOAD) that lets one call fail: the N-th of some kinds, on files under
 * some folder. Everything that is counted is decided by the environment, so every point can be named and met again.
 *
 *   OVERFLY_FAULT_UNDER    absolute path; calls on paths that begin with it are counted
 *   OVERFLY_FAULT_CALLS    which kinds of calls, a sum of the numbers below
 *   OVERFLY_FAULT_AT       which of them, from 1; 0: none, only count
 *   OVERFLY_FAULT_STAYS    1: all of them from there on
 *   OVERFLY_FAULT_DOES     kill   SIGKILL before the call
 *                          torn   SIGKILL after half of what is written, or after another call
 *                          power  SIGKILL before the call, and what was not synced is lost, all of it or some
 *                          fail   the call fails with OVERFLY_FAULT_ERRNO
 *                          short  half of what was asked is read or written, which is no error
 *                          end    nothing is read, as at a file's end
 *   OVERFLY_FAULT_REPORT   a file that gets "fired CALL PATH", and at the end "count" and how many calls of each kind there were
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <pthread.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

enum { READ = 1, WRITE = 2, MAKE = 4, OPEN = 8, SYNC = 16, CUT = 32, RENAME = 64, UNLINK = 128, LOOK = 256 };
enum act { PASS, KILL, TORN, POWER, FAIL, SHORT, END };

static const char *under, *report;
static size_t under_len;
static long at, calls;
static int stays, error_number;
static enum act does;
static atomic_long count, seen[9];
static int ready;

#define REAL(name) __typeof__(&name) real = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

static void say(const char *text) {
    static __typeof__(&open) real_open;
    static __typeof__(&write) real_write;
    if (!real_open) {
        real_open = (__typeof__(&open))dlsym(RTLD_NEXT, "open");
        real_write = (__typeof__(&write))dlsym(RTLD_NEXT, "write");
    }
    int fd = report ? real_open(report, O_WRONLY | O_CREAT | O_APPEND, 0644) : -1;
    if (fd >= 0) {
        if (real_write(fd, text, strlen(text)) < 0) abort();
        close(fd);
    }
}

static long number(const char *name) {
    const char *text = getenv(name);
    return text ? atol(text) : 0;
}

__attribute__((constructor)) static void begin(void) {
    static const char *words[] = {"", "kill", "torn", "power", "fail", "short", "end"};
    const char *word = getenv("OVERFLY_FAULT_DOES");
    for (int i = KILL; i <= END; i++)
        if (word && !strcmp(word, words[i])) does = i;
    under = getenv("OVERFLY_FAULT_UNDER");
    report = getenv("OVERFLY_FAULT_REPORT");
    under_len = under ? strlen(under) : 0;
    at = number("OVERFLY_FAULT_AT");
    calls = number("OVERFLY_FAULT_CALLS");
    stays = (int)number("OVERFLY_FAULT_STAYS");
    error_number = (int)number("OVERFLY_FAULT_ERRNO");
    ready = under != NULL;
}

__attribute__((destructor)) static void end(void) {
    char text[256] = "count";
    for (int i = 0; i < 9; i++) snprintf(text + strlen(text), 24, " %ld", atomic_load(&seen[i]));
    if (ready) say(strcat(text, "\n"));
}

/* ---- what a loss of power takes back: the bytes before each write that no sync has followed ---- */

struct undo {
    dev_t device;
    ino_t inode;
    int fd;
    off_t offset, size; /* size: of the file before */
    size_t len, kept;   /* kept: bytes of `old`; what is behind them was beyond the file's end */
    char *old;
    struct undo *before;
};
static struct undo *newest;
static pthread_mutex_t guard = PTHREAD_MUTEX_INITIALIZER;

static void remember(int fd, off_t offset, size_t len) {
    struct stat st;
    if (does != POWER || fstat(fd, &st) || !S_ISREG(st.st_mode)) return;
    pthread_mutex_lock(&guard);
    struct undo *one = calloc(1, sizeof *one);
    one->device = st.st_dev, one->inode = st.st_ino, one->offset = offset, one->size = st.st_size, one->len = len;
    one->fd = -1;
    for (struct undo *u = newest; u; u = u->before)
        if (u->device == st.st_dev && u->inode == st.st_ino) { one->fd = u->fd; break; }
    /* A descriptor of its own, never closed: closing it would drop the program's locks. It may read where `fd` may not. */
    if (one->fd < 0) {
        char self[64];
        snprintf(self, sizeof self, "/proc/self/fd/%d", fd);
        __typeof__(&open) real_open = (__typeof__(&open))dlsym(RTLD_NEXT, "open");
        one->fd = real_open(self, O_RDWR | O_CLOEXEC);
        if (one->fd < 0) abort();
    }
    one->old = malloc(len + 1);
    __typeof__(&pread) real_pread = (__typeof__(&pread))dlsym(RTLD_NEXT, "pread");
    ssize_t got = offset < st.st_size ? real_pread(one->fd, one->old, len, offset) : 0;
    one->kept = got > 0 ? (size_t)got : 0;
    one->before = newest;
    newest = one;
    pthread_mutex_unlock(&guard);
}

static void synced(int fd) {
    struct stat st;
    if (does != POWER || fstat(fd, &st)) return;
    pthread_mutex_lock(&guard);
    for (struct undo **u = &newest; *u;) {
        if ((*u)->device == st.st_dev && (*u)->inode == st.st_ino) {
            struct undo *gone = *u;
            *u = gone->before;
            free(gone->old);
            free(gone);
        } else {
            u = &(*u)->before;
        }
    }
    pthread_mutex_unlock(&guard);
}

/* At even points all that was not synced is lost; at odd ones, call by call, some of it, and what a file grew by is zeros. */
static void lose(void) {
    __typeof__(&pwrite) put = (__typeof__(&pwrite))dlsym(RTLD_NEXT, "pwrite");
    __typeof__(&ftruncate) cut = (__typeof__(&ftruncate))dlsym(RTLD_NEXT, "ftruncate");
    unsigned dice = (unsigned)at * 2654435761u + 12345u;
    for (struct undo *u = newest; u; u = u->before) {
        dice = dice * 1103515245u + 12345u;
        if (at % 2 && (dice >> 16) % 2) continue;
        if (put(u->fd, u->old, u->kept, u->offset) < 0) abort();
        if (at % 2 == 0) {
            if (cut(u->fd, u->size)) abort();
        } else if (u->kept < u->len) {
            char *zeros = calloc(1, u->len - u->kept);
            if (put(u->fd, zeros, u->len - u->kept, u->offset + (off_t)u->kept) < 0) abort();
        }
    }
}

/* ---- which call it is ---- */

static void die(void) {
    kill(getpid(), SIGKILL);
    for (;;) pause();
}

static int is_under(const char *path) { return ready && path && !strncmp(path, under, under_len); }

static int path_of(int fd, char path[4096]) {
    char self[64];
    snprintf(self, sizeof self, "/proc/self/fd/%d", fd);
    ssize_t len = ready ? readlink(self, path, 4095) : -1;
    path[len > 0 ? len : 0] = 0;
    return len > 0;
}

static enum act on(int kind, const char *call, const char *path) {
    if (!is_under(path)) return PASS;
    atomic_fetch_add(&seen[__builtin_ctz(kind)], 1);
    if (!(calls & kind)) return PASS;
    long n = atomic_fetch_add(&count, 1) + 1;
    if (at == 0 || n < at || (n > at && !stays)) return PASS;
    if (n == at) {
        char text[4200];
        snprintf(text, sizeof text, "fired %s %s\n", call, path);
        say(text);
    }
    if (does == POWER) lose();
    if (does == KILL || does == POWER) die();
    if (does == FAIL) errno = error_number;
    return does;
}

static enum act on_fd(int kind, const char *call, int fd) {
    char path[4096];
    if (!path_of(fd, path)) return PASS;
    return on(kind, call, path);
}

/* ---- the calls ---- */

static size_t half(size_t len) { return len > 1 ? len / 2 : len; }

#define READS(name, arguments, pass, pass_half) \
    ssize_t name arguments { \
        REAL(name); \
        enum act act = on_fd(READ, #name, fd); \
        if (act == FAIL) return -1; \
        if (act == END) return 0; \
        return act == SHORT ? real pass_half : real pass; \
    }
READS(read, (int fd, void *to, size_t len), (fd, to, len), (fd, to, half(len)))
READS(pread, (int fd, void *to, size_t len, off_t from), (fd, to, len, from), (fd, to, half(len), from))
READS(pread64, (int fd, void *to, size_t len, off64_t from), (fd, to, len, from), (fd, to, half(len), from))
READS(readv, (int fd, const struct iovec *to, int n), (fd, to, n), (fd, to, 1))

#define WRITES(name, arguments, offset, bytes, pass, pass_half) \
    ssize_t name arguments { \
        REAL(name); \
        enum act act = on_fd(WRITE, #name, fd); \
        if (act == FAIL) return -1; \
        char path[4096]; \
        if (does == POWER && path_of(fd, path) && is_under(path)) remember(fd, offset, bytes); \
        if (act == TORN && real pass_half >= 0) die(); \
        return act == SHORT ? real pass_half : real pass; \
    }
static size_t sum(const struct iovec *from, int n) {
    size_t all = 0;
    for (int i = 0; i < n; i++) all += from[i].iov_len;
    return all;
}
WRITES(write, (int fd, const void *from, size_t len), lseek(fd, 0, SEEK_CUR), len, (fd, from, len), (fd, from, half(len)))
WRITES(pwrite, (int fd, const void *from, size_t len, off_t to), to, len, (fd, from, len, to), (fd, from, half(len), to))
WRITES(pwrite64, (int fd, const void *from, size_t len, off64_t to), to, len, (fd, from, len, to), (fd, from, half(len), to))
WRITES(writev, (int fd, const struct iovec *from, int n), lseek(fd, 0, SEEK_CUR), sum(from, n), (fd, from, n), (fd, from, 1))

#define SYNCS(name) \
    int name(int fd) { \
        REAL(name); \
        enum act act = on_fd(SYNC, #name, fd); \
        if (act == FAIL) return -1; \
        int result = real(fd); \
        synced(fd); \
        if (act == TORN) die(); \
        return result; \
    }
SYNCS(fsync)
SYNCS(fdatasync)

#define CUTS(name, offset_type) \
    int name(int fd, offset_type len) { \
        REAL(name); \
        enum act act = on_fd(CUT, #name, fd); \
        if (act == FAIL) return -1; \
        struct stat st; \
        char path[4096]; \
        if (does == POWER && path_of(fd, path) && is_under(path) && !fstat(fd, &st)) \
            remember(fd, len, st.st_size > len ? (size_t)(st.st_size - len) : 0); \
        int result = real(fd, len); \
        if (act == TORN) die(); \
        return result; \
    }
CUTS(ftruncate, off_t)
CUTS(ftruncate64, off64_t)

static enum act on_open(const char *call, const char *path, int flags) {
    if (!is_under(path)) return PASS;
    __typeof__(&access) real_access = (__typeof__(&access))dlsym(RTLD_NEXT, "access");
    int makes = (flags & O_CREAT) && real_access(path, F_OK) != 0;
    return on(makes ? MAKE : OPEN, call, path);
}

#define OPENS(name, arguments, last, pass) \
    int name arguments { \
        REAL(name); \
        va_list more; \
        va_start(more, last); \
        mode_t mode = (flags & (O_CREAT | __O_TMPFILE)) ? va_arg(more, mode_t) : 0; \
        va_end(more); \
        enum act act = on_open(#name, path, flags); \
        if (act == FAIL) return -1; \
        int fd = real pass; \
        if (act == TORN) die(); \
        return fd; \
    }
OPENS(open, (const char *path, int flags, ...), flags, (path, flags, mode))
OPENS(open64, (const char *path, int flags, ...), flags, (path, flags, mode))
OPENS(openat, (int folder, const char *path, int flags, ...), flags, (folder, path, flags, mode))
OPENS(openat64, (int folder, const char *path, int flags, ...), flags, (folder, path, flags, mode))

#define NAMES(kind, name, arguments, path, pass) \
    int name arguments { \
        REAL(name); \
        enum act act = on(kind, #name, path); \
        if (act == FAIL) return -1; \
        int result = real pass; \
        if (act == TORN) die(); \
        return result; \
    }
NAMES(RENAME, rename, (const char *from, const char *to), from, (from, to))
NAMES(RENAME, renameat, (int a, const char *from, int b, const char *to), from, (a, from, b, to))
NAMES(UNLINK, unlink, (const char *path), path, (path))
NAMES(UNLINK, unlinkat, (int folder, const char *path, int flags), path, (folder, path, flags))

/* Rust's standard library looks at files by this call. SQLite's own, which take a file that cannot be looked at for one
 * that is not there, are left alone. */
int statx(int folder, const char *path, int flags, unsigned mask, struct statx *to) {
    REAL(statx);
    enum act act = path && *path ? on(LOOK, "statx", path) : on_fd(LOOK, "statx", folder);
    return act == FAIL ? -1 : real(folder, path, flags, mask, to);
}
