/* What C asks of a library, where there is none: mathematics is the browser's, copies are loops. */
#define BROWSER(name) __attribute__((import_module("math"), import_name(#name)))
BROWSER(sin) double sin(double);
BROWSER(cos) double cos(double);
BROWSER(tan) double tan(double);
BROWSER(asin) double asin(double);
BROWSER(acos) double acos(double);
BROWSER(atan) double atan(double);
BROWSER(exp) double exp(double);
BROWSER(log) double log(double);
BROWSER(tanh) double tanh(double);
BROWSER(atan2) double atan2(double, double);
BROWSER(pow) double pow(double, double);
#define sqrt __builtin_sqrt
#define fabs __builtin_fabs
#define floor __builtin_floor
#define ceil __builtin_ceil
#define nearbyint __builtin_nearbyint
#define copysign __builtin_copysign
static double fmin(double a, double b) { return a < b || b != b ? a : b; }
static double fmax(double a, double b) { return a > b || b != b ? a : b; }
static double fmod(double a, double b) { return a - b * __builtin_trunc(a / b); }
static double remainder(double a, double b) { return a - b * nearbyint(a / b); }
#define isfinite __builtin_isfinite
#define isnan __builtin_isnan
#define INFINITY __builtin_inf()
#define NAN __builtin_nan("")
typedef __SIZE_TYPE__ size_t;
__attribute__((no_builtin)) void *memcpy(void *to, const void *from, size_t size) {
  for (size_t i = 0; i < size; ++i) ((char *)to)[i] = ((const char *)from)[i];
  return to;
}
__attribute__((no_builtin)) void *memset(void *to, int value, size_t size) {
  for (size_t i = 0; i < size; ++i) ((char *)to)[i] = (char)value;
  return to;
}
__attribute__((no_builtin)) void *memmove(void *to, const void *from, size_t size) {
  if ((const char *)to <= (const char *)from) return memcpy(to, from, size);
  while (size--) ((char *)to)[size] = ((const char *)from)[size];
  return to;
}
