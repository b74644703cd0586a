/* @EQUATION@
 *
 * samples    @RATE@ per second: @CHANNEL_NAMES@
 * unknowns   @UNKNOWN_NAMES@
 * lines      @BAND@
 * forgets    @FORGETS@
 *
 * Call @NAME@_begin once, @NAME@_step with every sample and the seconds since the one before, and @NAME@_estimate whenever
 * numbers are wanted. @NAME@_step returns 0 while it is frozen (no number, a gap, a clock that jumped); @NAME@_estimate
 * returns 0, and leaves values and covariance as they may be, while the stream does not tell the unknowns apart.
 */
#ifndef @UPPER@_H
#define @UPPER@_H

#define @UPPER@_CHANNELS @CHANNELS@
#define @UPPER@_UNKNOWNS @UNKNOWNS@
#define @UPPER@_LINES @LINES@
#define @UPPER@_SUMS @SUMS@
#define @UPPER@_WINDOW @WINDOW@

typedef struct {
  @REAL@ sums[@UPPER@_SUMS][@UPPER@_LINES][2], window[@UPPER@_WINDOW][2], turned[2], last[@UPPER@_CHANNELS];
  int begun;
} @NAME@_memory;

typedef struct {
  @REAL@ right[@UPPER@_LINES][@UPPER@_UNKNOWNS][2], left[@UPPER@_LINES][2];
  @REAL@ power[@UPPER@_LINES], spare[@UPPER@_LINES];
  @REAL@ normal[@UPPER@_UNKNOWNS][@UPPER@_UNKNOWNS], lower[@UPPER@_UNKNOWNS][@UPPER@_UNKNOWNS];
  @REAL@ inverse[@UPPER@_UNKNOWNS][@UPPER@_UNKNOWNS], middle[@UPPER@_UNKNOWNS][@UPPER@_UNKNOWNS];
  @REAL@ moment[@UPPER@_UNKNOWNS], size[@UPPER@_UNKNOWNS], row[@UPPER@_UNKNOWNS][2];
} @NAME@_work;

void @NAME@_begin(@NAME@_memory *e);
int @NAME@_step(@NAME@_memory *e, @REAL@ elapsed, const @REAL@ sample[@UPPER@_CHANNELS]);
int @NAME@_estimate(const @NAME@_memory *e, @NAME@_work *w, @REAL@ values[@UPPER@_UNKNOWNS],
  @REAL@ covariance[@UPPER@_UNKNOWNS][@UPPER@_UNKNOWNS]);

#endif
