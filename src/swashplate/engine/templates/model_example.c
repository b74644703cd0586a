/* Flies @NAME@ for ten seconds from its start and prints the first states, one line a second.
 *
 *   cc -O2 -std=c99 @NAME@_example.c @NAME@.c -lm && ./a.out
 */
#include <stdio.h>

#include "@NAME@.h"

int main(void) {
  @REAL@ x[@NAME@_n_states];
  int i, k;
  for (i = 0; i < @NAME@_n_states; ++i) x[i] = @NAME@_start_x[i];
  for (k = 0; k <= 1000; ++k) {
    if (k % 100 == 0) {
      printf("%5.1f s", k * 0.01);
      for (i = 0; i < @SHOWN@; ++i) printf(" %9.4f", (double)x[i]);
      printf("\n");
    }
    @NAME@_step(x, @NAME@_start_u, @NAME@_start_s, @NAME@_start_p, (@REAL@)0.01);
  }
  return 0;
}
