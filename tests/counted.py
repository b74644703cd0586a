"""Numbers for C++ that count what is done with them: C as it stands, with `double` replaced by `Counted`."""

COUNTING = """#include <cmath>
static long operations = 0;
struct Counted {
  double value;
  Counted(double v = 0) : value(v) {}
  explicit operator double() const { return value; }
};
#define ARITHMETIC(o) static inline Counted operator o(Counted a, Counted b) { ++operations; return a.value o b.value; }
ARITHMETIC(+) ARITHMETIC(-) ARITHMETIC(*) ARITHMETIC(/)
#define CHANGE(o) static inline Counted &operator o(Counted &a, Counted b) { \\
  ++operations; a.value o b.value; return a; }
CHANGE(+=) CHANGE(-=) CHANGE(*=) CHANGE(/=)
#define COMPARE(o) static inline bool operator o(Counted a, Counted b) { return a.value o b.value; }
COMPARE(<) COMPARE(>) COMPARE(==) COMPARE(!=)
static inline Counted operator-(Counted a) { return -a.value; }
static inline Counted counted_root(Counted a) { ++operations; return std::sqrt(a.value); }
"""
