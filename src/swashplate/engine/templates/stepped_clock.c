/* The clock of Betaflight's SITL, loaded before its libraries (links/betaflight/stepped_clock.py): from the first state
   on, each state that it takes gives it @LOOP@ ns more, and its main thread waits when these are over. A main thread that
   waits for time makes it pass: @NAP@ ns where it sleeps, @LOOK@ ns where it looks; before the first state too, while it
   sleeps for as long as it asks. Its scheduler never runs its loop if more than a period passes before the first: so no
   time passes while the machine is busy with others. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <linux/futex.h>
#include <stdint.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static volatile int64_t now, until = INT64_MAX;
static volatile int states;
static __thread int took, thread;

static int is_main(void) {
  if (!thread) thread = (int)syscall(SYS_gettid);
  return thread == (int)getpid();
}

static void pass(int64_t ns) {
  int seen;
  while (seen = states, now >= until) syscall(SYS_futex, &states, FUTEX_WAIT, seen, (void *)0, (void *)0, 0);
  now = now + ns < until ? now + ns : until;
}

int clock_gettime(clockid_t which, struct timespec *told) {
  const int system = which != CLOCK_MONOTONIC || !now;
  const int had = system ? (int)syscall(SYS_clock_gettime, which, told) : 0;
  if (which == CLOCK_MONOTONIC && !now && is_main()) now = (int64_t)told->tv_sec * 1000000000 + told->tv_nsec;
  if (system) return had;
  if (is_main()) pass(@LOOK@);
  told->tv_sec = now / 1000000000;
  told->tv_nsec = now % 1000000000;
  return 0;
}

int nanosleep(const struct timespec *asked, struct timespec *left) {
  const int64_t ns = (int64_t)asked->tv_sec * 1000000000 + asked->tv_nsec;
  const int had = states && is_main() ? 0 : (int)syscall(SYS_nanosleep, asked, left);
  if (now && is_main()) pass(states ? @NAP@ : ns);
  return had;
}

ssize_t recvfrom(int fd, void *data, size_t size, int flags, struct sockaddr *from, socklen_t *room) {
  ssize_t (*real)(int, void *, size_t, int, struct sockaddr *, socklen_t *);
  ssize_t had;
  *(void **)&real = dlsym(RTLD_NEXT, "recvfrom");
  had = real(fd, data, size, flags, from, room);
  took = had == @STATE@;
  return had;
}

/* It waits for the next datagram, and so has taken the last one. */
int select(int most, fd_set *in, fd_set *out, fd_set *odd, struct timeval *wait) {
  int (*real)(int, fd_set *, fd_set *, fd_set *, struct timeval *);
  *(void **)&real = dlsym(RTLD_NEXT, "select");
  if (took) {
    until = (states ? until : now) + @LOOP@;
    __sync_synchronize();
    ++states;
    syscall(SYS_futex, &states, FUTEX_WAKE, 1, (void *)0, (void *)0, 0);
    took = 0;
  }
  return real(most, in, out, odd, wait);
}
