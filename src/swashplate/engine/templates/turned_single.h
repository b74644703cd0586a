/* sin(x + quarter pi / 2): the nearest multiple of pi / 2 is taken away, its last two bits choose what is left. */
static inline __attribute__((unused)) real turned(real x, int quarter) {
  const real moved = x * 0.63661975f + 1.2582912e+07f, turns = moved - 1.2582912e+07f;
  const real r = x - turns * 1.5703125f - turns * 0.0004837513f - turns * 7.54979e-08f, z = r * r;
  const real sine = r + r * z * ((-0.00019515296f * z + 0.008332161f) * z + -0.16666655f), cosine = 1 - z / 2 + z * z * ((2.4433157e-05f * z + -0.0013887316f) * z + 0.041666646f);
  union { real number; whole bits; } of = {moved}, to;
  const whole odd = (whole)((unsigned int)of.bits << (32 - 1));
  const whole two = (whole)((unsigned int)of.bits << (32 - 2));
  const whole top = (whole)((unsigned int)1 << (32 - 1));
  to.number = (odd < 0) != (quarter != 0) ? cosine : sine;
  to.bits ^= (quarter ? two ^ odd : two) & top;
  return to.number;
}
