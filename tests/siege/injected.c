/* Preloaded before a program: counts its calls that change files under one folder, and at one of them kills the process
 * or lets the call, and all later ones that need space, fail. Armed by siege_arm(); see tests/siege/kills.py. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { COUNT, KILL, HALF, FAIL };
static char prefix[PATH_MAX];
static int mode = COUNT, number = 0;
static long stop = 0, calls = 0;
static unsigned char ours[65536];

void siege_arm(const char *folder, int how, long at, int error) {
    strncpy(prefix, folder, sizeof prefix - 1);
    mode = how, stop = at, number = error, calls = 0;
    memset(ours, 0, sizeof ours);
}
long siege_calls(void) { return calls; }

static int inside(int folder, const char *path) {
    char whole[2 * PATH_MAX], base[PATH_MAX];
    if (!prefix[0] || !path) return 0;
    if (path[0] != '/') {
        char link[64];
        ssize_t n;
        if (folder == AT_FDCWD) {
            if (!getcwd(base, sizeof base)) return 0;
        } else {
            snprintf(link, sizeof link, "/proc/self/fd/%d", folder);
            n = readlink(link, base, sizeof base - 1);
            if (n < 0) return 0;
            base[n] = 0;
        }
        snprintf(whole, sizeof whole, "%s/%s", base, path);
        path = whole;
    }
    return strncmp(path, prefix, strlen(prefix)) == 0;
}
static int is_ours(int fd) { return prefix[0] && fd >= 0 && fd < (int)sizeof ours && ours[fd]; }
static void mark(int fd, int yes) { if (fd >= 0 && fd < (int)sizeof ours) ours[fd] = (unsigned char)yes; }

/* 1: this call must fail with `number`. `space`: whether it needs room on the disk. */
static int hit(int space) {
    long now = __sync_add_and_fetch(&calls, 1);
    if ((mode == KILL || (mode == HALF && !space)) && now == stop) kill(getpid(), SIGKILL);
    if (mode == FAIL && now >= stop && (space || (number != ENOSPC && number != EDQUOT))) { errno = number; return 1; }
    return 0;
}
static int half(void) { return mode == HALF && calls == stop; }

#define NEXT(type, name, args) static type(*next) args; if (!next) next = (type(*) args)dlsym(RTLD_NEXT, #name)

#define OPENS(name) \
int name(const char *path, int flags, ...) { \
    NEXT(int, name, (const char *, int, ...)); mode_t m = 0; va_list a; \
    if (flags & (O_CREAT | O_TMPFILE)) { va_start(a, flags); m = va_arg(a, mode_t); va_end(a); } \
    int mine = (flags & (O_WRONLY | O_RDWR | O_CREAT)) && inside(AT_FDCWD, path); \
    if (mine && (flags & O_CREAT) && hit(1)) return -1; \
    int fd = next(path, flags, m); mark(fd, mine); return fd; }
OPENS(open) OPENS(open64)
#define OPENATS(name) \
int name(int folder, const char *path, int flags, ...) { \
    NEXT(int, name, (int, const char *, int, ...)); mode_t m = 0; va_list a; \
    if (flags & (O_CREAT | O_TMPFILE)) { va_start(a, flags); m = va_arg(a, mode_t); va_end(a); } \
    int mine = (flags & (O_WRONLY | O_RDWR | O_CREAT)) && inside(folder, path); \
    if (mine && (flags & O_CREAT) && hit(1)) return -1; \
    int fd = next(folder, path, flags, m); mark(fd, mine); return fd; }
OPENATS(openat) OPENATS(openat64)
#define FOPENS(name) \
FILE *name(const char *path, const char *how) { \
    NEXT(FILE *, name, (const char *, const char *)); \
    int mine = strpbrk(how, "wa+") && inside(AT_FDCWD, path); \
    if (mine && hit(1)) return NULL; \
    FILE *f = next(path, how); if (f) mark(fileno(f), mine); return f; }
FOPENS(fopen) FOPENS(fopen64)

ssize_t write(int fd, const void *data, size_t n) {
    NEXT(ssize_t, write, (int, const void *, size_t));
    if (is_ours(fd)) {
        if (hit(1)) return -1;
        if (half()) { next(fd, data, n / 2); kill(getpid(), SIGKILL); }
    }
    return next(fd, data, n);
}
#define PWRITES(name, off) \
ssize_t name(int fd, const void *data, size_t n, off at) { \
    NEXT(ssize_t, name, (int, const void *, size_t, off)); \
    if (is_ours(fd)) { if (hit(1)) return -1; if (half()) { next(fd, data, n / 2, at); kill(getpid(), SIGKILL); } } \
    return next(fd, data, n, at); }
PWRITES(pwrite, off_t) PWRITES(pwrite64, off64_t)
ssize_t writev(int fd, const struct iovec *v, int n) {
    NEXT(ssize_t, writev, (int, const struct iovec *, int));
    if (is_ours(fd) && (hit(1) || half())) { if (half()) kill(getpid(), SIGKILL); return -1; }
    return next(fd, v, n);
}
#define ON_FD(name, space) \
int name(int fd) { NEXT(int, name, (int)); if (is_ours(fd) && hit(space)) return -1; return next(fd); }
ON_FD(fsync, 1) ON_FD(fdatasync, 1)
int close(int fd) {
    NEXT(int, close, (int));
    if (is_ours(fd)) { if (mode != FAIL) hit(0); mark(fd, 0); }
    return next(fd);
}
#define TRUNCATES(name, off) \
int name(int fd, off n) { NEXT(int, name, (int, off)); if (is_ours(fd) && hit(1)) return -1; return next(fd, n); }
TRUNCATES(ftruncate, off_t) TRUNCATES(ftruncate64, off64_t)
#define ON_PATH(name, space) \
int name(const char *path) { NEXT(int, name, (const char *)); \
    if (inside(AT_FDCWD, path) && hit(space)) return -1; return next(path); }
ON_PATH(unlink, 0) ON_PATH(rmdir, 0)
int unlinkat(int folder, const char *path, int flags) {
    NEXT(int, unlinkat, (int, const char *, int));
    if (inside(folder, path) && hit(0)) return -1;
    return next(folder, path, flags);
}
int mkdir(const char *path, mode_t m) {
    NEXT(int, mkdir, (const char *, mode_t));
    if (inside(AT_FDCWD, path) && hit(1)) return -1;
    return next(path, m);
}
int chmod(const char *path, mode_t m) {
    NEXT(int, chmod, (const char *, mode_t));
    if (inside(AT_FDCWD, path) && hit(0)) return -1;
    return next(path, m);
}
#define TWO_PATHS(name) \
int name(const char *a, const char *b) { NEXT(int, name, (const char *, const char *)); \
    if ((inside(AT_FDCWD, a) || inside(AT_FDCWD, b)) && hit(1)) return -1; return next(a, b); }
TWO_PATHS(rename) TWO_PATHS(link)
int renameat(int fa, const char *a, int fb, const char *b) {
    NEXT(int, renameat, (int, const char *, int, const char *));
    if ((inside(fa, a) || inside(fb, b)) && hit(1)) return -1;
    return next(fa, a, fb, b);
}
int linkat(int fa, const char *a, int fb, const char *b, int flags) {
    NEXT(int, linkat, (int, const char *, int, const char *, int));
    if ((inside(fa, a) || inside(fb, b)) && hit(1)) return -1;
    return next(fa, a, fb, b, flags);
}
