"""The covariance of many observers in C, called from XLA's programs: four vehicles, or eight, are one vector.

XLA spends three quarters of a filter's step on copies: it turns stacks of matrices so that the vehicle comes first
wherever it multiplies, and back. Here as many vehicles as the processor's vectors hold are packed, products leave out
what is zero in all of them (most of a Jacobian is), and only half of a symmetric matrix is computed. Compiled where a C
compiler is.
"""

from __future__ import annotations

from functools import lru_cache
from threading import Lock
from typing import Any

from swashplate.compiled import NATIVE, loaded
from swashplate.compiler import compiler
from swashplate.errors import SwashError
from swashplate.jax_on_demand import jax, jnp

_OPTIONS = ("-O3", NATIVE, "-ffp-contract=fast", "-fno-math-errno", "-Wno-psabi")
_MOST = 40
"""Estimates at most: what is packed lies on the stack of a thread."""

_ONE_AT_A_TIME = Lock()


@lru_cache(maxsize=1)
def kernels() -> bool:
    """Compile the kernels and tell XLA of them; False where that cannot be done here."""
    if compiler() is None or jax.default_backend() != "cpu":
        return False
    try:
        library = loaded(_SOURCE, options=(*_OPTIONS, "-isystem", jax.ffi.include_dir()))
        for name in ("propagated", "updated"):
            target = jax.ffi.pycapsule(getattr(library, f"swash_{name}"))
            jax.ffi.register_ffi_target(f"swash_{name}", target, platform="cpu")
    except (SwashError, OSError, AttributeError):  # no headers of XLA, or of another form
        return False
    return True


def fits(estimates: int) -> bool:
    """Whether the kernels can be had for so many estimates."""
    with _ONE_AT_A_TIME:  # blocks of a batch are traced in threads, and XLA takes a name once
        return estimates <= _MOST and kernels()


def propagated(A: Any, J: Any, P: Any, noise: Any, dt: float) -> Any:
    """G P G' + diag(noise), shape (N, N, vehicles).

    Args:
        A: shape (m, m, vehicles); the first rows of G are its exponential e^(A dt), to fourth order.
        J: the last rows of G, shape (r, N, vehicles); those between are of the identity.
        P: symmetric, shape (N, N, vehicles).
        noise: shape (N,).
        dt: step [s].
    """
    return jax.ffi.ffi_call("swash_propagated", _like(P, P.shape))(A, J, P, noise, jnp.asarray(dt, P.dtype))


def updated(H: Any, P: Any, mean: Any, news: Any, noise: Any) -> tuple[Any, Any, Any]:
    """Mean (N, vehicles) and covariance (N, N, vehicles) after readings, and the covariance of the innovations.

    Args:
        H: shape (readings, N, vehicles).
        P: symmetric, shape (N, N, vehicles).
        mean: shape (N, vehicles).
        news: innovations, shape (readings, vehicles).
        noise: variance of the readings, shape (readings,).
    """
    count = H.shape[0]
    shapes = [_like(P, shape) for shape in (mean.shape, P.shape, (count, count, P.shape[2]))]
    mean, covariance, spread = jax.ffi.ffi_call("swash_updated", shapes)(H, P, mean, news, noise)
    return mean, covariance, spread


def _like(P: Any, shape: tuple[int, ...]) -> jax.ShapeDtypeStruct:
    return jax.ShapeDtypeStruct(shape, P.dtype)


_SOURCE = """#include <math.h>
#include <string.h>
#include "xla/ffi/api/c_api.h"

#ifdef __AVX512F__
enum { V = 8, TILE = 8 };
#else
enum { V = 4, TILE = 8 };
#endif
typedef double vector __attribute__((vector_size(V * sizeof(double))));

static int any(vector x) {
  int found = 0;
  for (int l = 0; l < V; ++l) found |= x[l] != 0;
  return found;
}

static long vehicles_in(long n, long at) { return n - at < V ? n - at : V; }

/* V vehicles of a stack from vehicle `at` on; missing ones repeat the last. */
static void pack(vector *to, const double *from, long count, long n, long at) {
  const long here = vehicles_in(n, at);
  for (long i = 0; i < count; ++i) {
    const double *row = from + i * n + at;
    if (here == V) memcpy(to + i, row, sizeof(vector));
    else for (long l = 0; l < V; ++l) to[i][l] = row[l < here ? l : here - 1];
  }
}

static void unpack(double *to, const vector *from, long count, long n, long at) {
  const long here = vehicles_in(n, at);
  for (long i = 0; i < count; ++i) memcpy(to + i * n + at, from + i, (size_t)here * sizeof(double));
}

/* Of each row the columns in which one of the vehicles is not zero. */
static void find(const vector *a, long rows, long columns, int *used, int *count) {
  for (long i = 0; i < rows; ++i) {
    count[i] = 0;
    for (long k = 0; k < columns; ++k) {
      used[i * columns + count[i]] = (int)k;
      count[i] += any(a[i * columns + k]);
    }
  }
}

/* out = scale a b, row i and column j of it at out[i down + j across]; of a symmetric one half: columns up to i. */
static void times(vector *out, long down, long across, const vector *a, const int *used, const int *count, long rows,
                  long inner, const vector *b, long columns, double scale, int half) {
  for (long j = 0; j < columns; j += TILE) {
    const long wide = columns - j < TILE ? columns - j : TILE;
    for (long i = half ? j : 0; i < rows; ++i) {
      const int *list = used + i * inner;
      vector sum[TILE];
      for (int t = 0; t < TILE; ++t) sum[t] = (vector){0};
      if (wide == TILE)
        for (int q = 0; q < count[i]; ++q) {
          const vector x = a[i * inner + list[q]], *right = b + list[q] * columns + j;
          for (int t = 0; t < TILE; ++t) sum[t] += x * right[t];
        }
      else
        for (int q = 0; q < count[i]; ++q) {
          const vector x = a[i * inner + list[q]], *right = b + list[q] * columns + j;
          for (long t = 0; t < wide; ++t) sum[t] += x * right[t];
        }
      for (long t = 0; t < wide; ++t) out[i * down + (j + t) * across] = scale * sum[t];
    }
  }
}

static void mirror(vector *p, long N) {
  for (long i = 0; i < N; ++i)
    for (long j = 0; j < i; ++j) p[j * N + i] = p[i * N + j];
}

static XLA_FFI_Error *version(XLA_FFI_CallFrame *frame, int *asked) {
  for (XLA_FFI_Extension_Base *e = frame->extension_start; e; e = e->next)
    if (e->type == XLA_FFI_Extension_Metadata) {
      XLA_FFI_Metadata *told = ((XLA_FFI_Metadata_Extension *)e)->metadata;
      told->api_version.major_version = XLA_FFI_API_MAJOR;
      told->api_version.minor_version = XLA_FFI_API_MINOR;
      told->traits = 0;
      *asked = 1;
    }
  return 0;
}

#define GIVEN(i) ((const XLA_FFI_Buffer *)frame->args.args[i])
#define FOUND(i) ((const XLA_FFI_Buffer *)frame->rets.rets[i])

XLA_FFI_Error *swash_propagated(XLA_FFI_CallFrame *frame);
XLA_FFI_Error *swash_updated(XLA_FFI_CallFrame *frame);

XLA_FFI_Error *swash_propagated(XLA_FFI_CallFrame *frame) {
  int asked = 0;
  version(frame, &asked);
  if (asked) return 0;
  const long m = GIVEN(0)->dims[0], r = GIVEN(1)->dims[0], N = GIVEN(2)->dims[0], n = GIVEN(2)->dims[2];
  const double *noise = GIVEN(3)->data, dt = *(const double *)GIVEN(4)->data;
  vector a[m * m], h[m * m], f[m * m], g[N * N], p[N * N], t[N * N];
  int used[N * N], count[N];
  for (long at = 0; at < n; at += V) {
    pack(a, GIVEN(0)->data, m * m, n, at);
    pack(p, GIVEN(2)->data, N * N, n, at);
    find(a, m, m, used, count);
    for (long i = 0; i < m * m; ++i) h[i] = a[i] * (dt / 4);
    for (int order = 3; order > 0; --order) {
      for (long i = 0; i < m; ++i) h[i * m + i] += 1;
      times(f, m, 1, a, used, count, m, m, h, m, dt / order, 0);
      memcpy(h, f, sizeof h);
    }
    memset(g, 0, sizeof g);
    for (long i = 0; i < m; ++i) {
      memcpy(g + i * N, h + i * m, (size_t)m * sizeof(vector));
      g[i * N + i] += 1;
    }
    for (long i = m; i < N - r; ++i) g[i * N + i] += 1;
    pack(g + (N - r) * N, GIVEN(1)->data, r * N, n, at);
    find(g, N, N, used, count);
    times(t, 1, N, g, used, count, N, N, p, N, 1, 0);  /* (G P)' */
    times(p, N, 1, g, used, count, N, N, t, N, 1, 1);
    for (long i = 0; i < N; ++i) p[i * N + i] += noise[i];
    mirror(p, N);
    unpack(FOUND(0)->data, p, N * N, n, at);
  }
  return 0;
}

XLA_FFI_Error *swash_updated(XLA_FFI_CallFrame *frame) {
  int asked = 0;
  version(frame, &asked);
  if (asked) return 0;
  const long c = GIVEN(0)->dims[0], N = GIVEN(1)->dims[0], n = GIVEN(1)->dims[2];
  const double *noise = GIVEN(4)->data;
  vector h[c * N], p[N * N], mean[N], news[c], hp[c * N], s[c * c], told[N * c], less[N * N];
  int used[N * N], count[N];
  for (long at = 0; at < n; at += V) {
    pack(h, GIVEN(0)->data, c * N, n, at);
    pack(p, GIVEN(1)->data, N * N, n, at);
    pack(mean, GIVEN(2)->data, N, n, at);
    pack(news, GIVEN(3)->data, c, n, at);
    find(h, c, N, used, count);
    times(hp, N, 1, h, used, count, c, N, p, N, 1, 0);
    for (long i = 0; i < c; ++i)
      for (long j = 0; j < c; ++j) {
        vector sum = {0};
        for (int q = 0; q < count[i]; ++q) sum += h[i * N + used[i * N + q]] * hp[j * N + used[i * N + q]];
        s[i * c + j] = i == j ? sum + noise[i] : sum;
      }
    unpack(FOUND(2)->data, s, c * c, n, at);
    for (long i = 0; i < c; ++i) {  /* rows of [S | H P | innovation] without those above them */
      vector one;
      for (int l = 0; l < V; ++l) one[l] = 1 / sqrt(s[i * c + i][l]);
      for (long j = i; j < c; ++j) s[i * c + j] *= one;
      for (long j = 0; j < N; ++j) hp[i * N + j] *= one;
      news[i] *= one;
      for (long k = i + 1; k < c; ++k) {
        const vector x = s[i * c + k];
        if (!any(x)) continue;
        for (long j = k; j < c; ++j) s[k * c + j] -= x * s[i * c + j];
        for (long j = 0; j < N; ++j) hp[k * N + j] -= x * hp[i * N + j];
        news[k] -= x * news[i];
      }
    }
    for (long i = 0; i < c; ++i)
      for (long j = 0; j < N; ++j) {
        told[j * c + i] = hp[i * N + j];
        mean[j] += hp[i * N + j] * news[i];
      }
    find(told, N, c, used, count);
    times(less, N, 1, told, used, count, N, c, hp, N, 1, 1);
    for (long i = 0; i < N; ++i)
      for (long j = 0; j <= i; ++j) p[i * N + j] -= less[i * N + j];
    mirror(p, N);
    unpack(FOUND(0)->data, mean, N, n, at);
    unpack(FOUND(1)->data, p, N * N, n, at);
  }
  return 0;
}
"""
