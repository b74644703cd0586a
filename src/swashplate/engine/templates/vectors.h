#if defined(__AVX512F__)
enum { V = 8 };
#elif defined(__AVX__)
enum { V = 4 };
#else
enum { V = 2 };
#endif
typedef double vec __attribute__((vector_size(V * sizeof(double))));
typedef long long bits __attribute__((vector_size(V * sizeof(long long))));
static inline __attribute__((unused)) vec kept(vec d, int here) { return (vec)((bits)d & -(long long)(here != 0)); }
