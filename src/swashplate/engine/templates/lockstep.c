/* Ordinary frames of ArduPilot: a packet in, the physics on, the answer out, until something needs Python
   (links/ardupilot/lockstep.py fills the blanks). */
#include <arpa/inet.h>
#include <math.h>
#include <stdint.h>
#include <string.h>
#include <sys/socket.h>

struct link {
  void (*frame)(double *, const double *, const double *, const double *, const double *, double, int, double *);
  double *x, *u, *s, *p, *g, *told;
  const char *form;
  double duration, time, until, throttle, voltage;
  int fd, steps, rate, flown, length, size, held;
  uint32_t count;
  unsigned char address[4], port[2], data[@LONGEST@];
  char answer[@ROOM@];
};

static void moved(const double *pulses, const double *duration, const double *throttle, double *u, double *after) {
@MOVED@}

static void felt(const double *told, const double *time, const double *voltage, double *r) {
@FELT@}

static int whole(const double *told) {
  double sum = 0.0;
  int k;
  for (k = 0; k < @STATES@ + 6; ++k) sum += told[k];
  if (!isfinite(sum) || told[@Z@] > 0.0) return 0;
  for (k = 0; k < 3; ++k)
    if (fabs(told[@U@ + k]) > @FASTEST@ || fabs(told[@P@ + k]) > @FASTEST@) return 0;
  return 1;
}

static int ordinary(const struct link *l, double *pulses) {
  static const int forms[][2] = {@FORMS@}, used[] = {@USED@};
  uint16_t head[2], pulse;
  uint32_t count;
  int k, n;
  if (l->size < 8) return 0;
  memcpy(head, l->data, 4);
  memcpy(&count, l->data + 4, 4);
  for (k = 0; k < 2 && (head[0] != forms[k][0] || l->size != forms[k][1]); ++k) {}
  if (k == 2 || count != l->count + 1 || head[1] > l->rate + 1 || head[1] < l->rate - 1) return 0;
  n = (l->size - 8) / 2;
  for (k = 0; k < n; ++k) {
    memcpy(&pulse, l->data + 8 + 2 * k, 2);
    pulses[k] = pulse;
  }
  for (k = 0; k < (int)(sizeof used / sizeof *used); ++k)
    if (used[k] >= n || ((pulses[used[k]] < @LEAST@ || pulses[used[k]] > @MOST@) && pulses[used[k]] != @NONE@))
      return 0;
  return 1;
}

/* As `decimal` of links/ardupilot/answer.py. */
static char *decimal(char *to, double value) {
  char digits[24];
  uint64_t rest = (uint64_t)(fabs(value) * 1e9 + 0.5);
  int n = 0;
  if (value < 0.0 && rest) *to++ = '-';
  for (; rest || n < 10; rest /= 10) {
    if (n == 9) digits[n++] = '.';
    digits[n++] = (char)('0' + rest % 10);
  }
  while (n) *to++ = digits[--n];
  return to;
}

static int written(const char *form, const double *r, char *answer) {
  char *to = answer;
  for (; *form; ++form)
    if (*form == '%') to = decimal(to, *r++);
    else *to++ = *form;
  return (int)(to - answer);
}

/* The last answer before `until` is held, and sent when this is called again: sticks are moved before it. */
void fly(struct link *l) {
  double pulses[@CHANNELS@] = {0}, r[@NUMBERS@], after;
  struct sockaddr_in from;
  socklen_t room = sizeof from;
  memset(&from, 0, sizeof from);
  from.sin_family = AF_INET;
  memcpy(&from.sin_addr, l->address, 4);
  memcpy(&from.sin_port, l->port, 2);
  for (l->flown = 0; !l->held || l->time < l->until - 1e-9; ++l->flown, ++l->count) {
    if (l->held) sendto(l->fd, l->answer, (size_t)l->length, 0, (struct sockaddr *)&from, room);
    l->held = 0;
    l->size = (int)recvfrom(l->fd, l->data, sizeof l->data, 0, (struct sockaddr *)&from, &room);
    if (l->size < 0) return;
    if (memcmp(&from.sin_addr, l->address, 4) || memcmp(&from.sin_port, l->port, 2)) {
      memcpy(l->address, &from.sin_addr, 4);
      memcpy(l->port, &from.sin_port, 2);
      return;
    }
    if (!ordinary(l, pulses)) return;
    moved(pulses, &l->duration, &l->throttle, l->u, &after);
    l->throttle = after;
    l->frame(l->x, l->u, l->s, l->p, l->g, l->duration / l->steps, l->steps, l->told);
    if (!whole(l->told)) return;
    l->time += l->duration;
    felt(l->told, &l->time, &l->voltage, r);
    l->length = written(l->form, r, l->answer);
    l->held = 1;
  }
}
