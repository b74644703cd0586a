/* sin(x + quarter pi / 2): the nearest multiple of pi / 2 is taken away, its last two bits choose what is left. */
static inline __attribute__((unused)) real turned(real x, int quarter) {
  const real moved = x * 0.6366197723675814 + 6755399441055744.0, turns = moved - 6755399441055744.0;
  const real r = x - turns * 1.5707963267341256 - turns * 6.077100506303966e-11, z = r * r;
  const real sine = r + r * z * (((((1.58969099521155e-10 * z + -2.5050760253406863e-08) * z + 2.7557313707070068e-06) * z + -0.0001984126982985795) * z + 0.00833333333332249) * z + -0.16666666666666632), cosine = 1 - z / 2 + z * z * (((((-1.1359647557788195e-11 * z + 2.087572321298175e-09) * z + -2.7557314351390663e-07) * z + 2.480158728947673e-05) * z + -0.001388888888887411) * z + 0.0416666666666666);
  union { real number; whole bits; } of = {moved}, to;
  const whole odd = (whole)((unsigned long long)of.bits << (64 - 1));
  const whole two = (whole)((unsigned long long)of.bits << (64 - 2));
  const whole top = (whole)((unsigned long long)1 << (64 - 1));
  to.number = (odd < 0) != (quarter != 0) ? cosine : sine;
  to.bits ^= (quarter ? two ^ odd : two) & top;
  return to.number;
}
