// Vectors of lanes over the vector extensions of GCC and Clang; one lane is a plain scalar. Arithmetic,
// comparison and ?: are the language's own; here is what it does not have. All is local to the file that
// includes this one: files are compiled for different processors.
#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#else
#error "lanes are written for x86-64 and arm64"
#endif

#include <cstdint>

#include "lpss/solver/contact_rows.h"

namespace tessera {
namespace {

typedef float Float4 __attribute__((vector_size(16), may_alias));
typedef double Double2 __attribute__((vector_size(16), may_alias));
typedef float LooseFloat4 __attribute__((vector_size(16), may_alias, aligned(4)));
typedef double LooseDouble2 __attribute__((vector_size(16), may_alias, aligned(8)));

#define TESSERA_INLINE inline __attribute__((always_inline))

// kQuarter scalars are one load of 128 bits, aligned or (LooseQuarter) not.
template <typename Scalar, int kWidth>
struct Lanes;

template <typename T>
struct Lanes<T, 1> {
  using Scalar = T;
  using Vector = T;
  using Quarter = T;
  using LooseQuarter = T;
  static constexpr int kWidth = 1;
  static constexpr int kQuarter = 1;
  static TESSERA_INLINE Vector join(const Quarter* q) { return q[0]; }
  static TESSERA_INLINE Quarter part(const Vector& v, int) { return v; }
  static TESSERA_INLINE void transpose(Vector*) {}
};

template <>
struct Lanes<float, 4> {
  using Scalar = float;
  using Vector = Float4;
  using Quarter = Float4;
  using LooseQuarter = LooseFloat4;
  static constexpr int kWidth = 4;
  static constexpr int kQuarter = 4;
  static TESSERA_INLINE Vector join(const Quarter* q) { return q[0]; }
  static TESSERA_INLINE Quarter part(const Vector& v, int) { return v; }
  static TESSERA_INLINE void transpose(Vector* r) {
    const Vector low01 = __builtin_shufflevector(r[0], r[1], 0, 4, 1, 5);
    const Vector high01 = __builtin_shufflevector(r[0], r[1], 2, 6, 3, 7);
    const Vector low23 = __builtin_shufflevector(r[2], r[3], 0, 4, 1, 5);
    const Vector high23 = __builtin_shufflevector(r[2], r[3], 2, 6, 3, 7);
    r[0] = __builtin_shufflevector(low01, low23, 0, 1, 4, 5);
    r[1] = __builtin_shufflevector(low01, low23, 2, 3, 6, 7);
    r[2] = __builtin_shufflevector(high01, high23, 0, 1, 4, 5);
    r[3] = __builtin_shufflevector(high01, high23, 2, 3, 6, 7);
  }
};

template <>
struct Lanes<double, 2> {
  using Scalar = double;
  using Vector = Double2;
  using Quarter = Double2;
  using LooseQuarter = LooseDouble2;
  static constexpr int kWidth = 2;
  static constexpr int kQuarter = 2;
  static TESSERA_INLINE Vector join(const Quarter* q) { return q[0]; }
  static TESSERA_INLINE Quarter part(const Vector& v, int) { return v; }
  static TESSERA_INLINE void transpose(Vector* r) {
    const Vector low = __builtin_shufflevector(r[0], r[1], 0, 2);
    r[1] = __builtin_shufflevector(r[0], r[1], 1, 3);
    r[0] = low;
  }
};

// any(): whether a lane is above 0.
TESSERA_INLINE bool any(float x) { return x > 0; }
TESSERA_INLINE bool any(double x) { return x > 0; }

#if defined(__x86_64__)
TESSERA_INLINE float root(float x) { return _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(x))); }
TESSERA_INLINE double root(double x) { return _mm_cvtsd_f64(_mm_sqrt_sd(_mm_setzero_pd(), _mm_set_sd(x))); }
TESSERA_INLINE Float4 root(Float4 x) { return _mm_sqrt_ps(x); }
TESSERA_INLINE Double2 root(Double2 x) { return _mm_sqrt_pd(x); }
TESSERA_INLINE bool any(Float4 x) { return _mm_movemask_ps(_mm_cmpgt_ps(x, _mm_setzero_ps())) != 0; }
TESSERA_INLINE bool any(Double2 x) { return _mm_movemask_pd(_mm_cmpgt_pd(x, _mm_setzero_pd())) != 0; }
#else
TESSERA_INLINE float root(float x) { return vget_lane_f32(vsqrt_f32(vdup_n_f32(x)), 0); }
TESSERA_INLINE double root(double x) { return vget_lane_f64(vsqrt_f64(vdup_n_f64(x)), 0); }
TESSERA_INLINE Float4 root(Float4 x) { return vsqrtq_f32(x); }
TESSERA_INLINE Double2 root(Double2 x) { return vsqrtq_f64(x); }
TESSERA_INLINE bool any(Float4 x) { return vmaxvq_u32(vcgtzq_f32(x)) != 0; }
TESSERA_INLINE bool any(Double2 x) { return vmaxvq_u32(vreinterpretq_u32_u64(vcgtzq_f64(x))) != 0; }
#endif

#ifdef __AVX2__
typedef float Float8 __attribute__((vector_size(32), may_alias));
typedef double Double4 __attribute__((vector_size(32), may_alias));

template <>
struct Lanes<float, 8> {
  using Scalar = float;
  using Vector = Float8;
  using Quarter = Float4;
  using LooseQuarter = LooseFloat4;
  static constexpr int kWidth = 8;
  static constexpr int kQuarter = 4;
  static TESSERA_INLINE Vector join(const Quarter* q) {
    return __builtin_shufflevector(q[0], q[1], 0, 1, 2, 3, 4, 5, 6, 7);
  }
  static TESSERA_INLINE Quarter part(const Vector& v, int half) {
    return half == 0 ? __builtin_shufflevector(v, v, 0, 1, 2, 3) : __builtin_shufflevector(v, v, 4, 5, 6, 7);
  }
  static TESSERA_INLINE void transpose(Vector* r) {
    const Vector low01 = __builtin_shufflevector(r[0], r[1], 0, 8, 1, 9, 4, 12, 5, 13);
    const Vector high01 = __builtin_shufflevector(r[0], r[1], 2, 10, 3, 11, 6, 14, 7, 15);
    const Vector low23 = __builtin_shufflevector(r[2], r[3], 0, 8, 1, 9, 4, 12, 5, 13);
    const Vector high23 = __builtin_shufflevector(r[2], r[3], 2, 10, 3, 11, 6, 14, 7, 15);
    r[0] = __builtin_shufflevector(low01, low23, 0, 1, 8, 9, 4, 5, 12, 13);
    r[1] = __builtin_shufflevector(low01, low23, 2, 3, 10, 11, 6, 7, 14, 15);
    r[2] = __builtin_shufflevector(high01, high23, 0, 1, 8, 9, 4, 5, 12, 13);
    r[3] = __builtin_shufflevector(high01, high23, 2, 3, 10, 11, 6, 7, 14, 15);
  }
};

template <>
struct Lanes<double, 4> {
  using Scalar = double;
  using Vector = Double4;
  using Quarter = Double2;
  using LooseQuarter = LooseDouble2;
  static constexpr int kWidth = 4;
  static constexpr int kQuarter = 2;
  static TESSERA_INLINE Vector join(const Quarter* q) {
    return __builtin_shufflevector(q[0], q[1], 0, 1, 2, 3);
  }
  static TESSERA_INLINE Quarter part(const Vector& v, int half) {
    return half == 0 ? __builtin_shufflevector(v, v, 0, 1) : __builtin_shufflevector(v, v, 2, 3);
  }
  static TESSERA_INLINE void transpose(Vector* r) {
    const Vector low = __builtin_shufflevector(r[0], r[1], 0, 4, 2, 6);
    r[1] = __builtin_shufflevector(r[0], r[1], 1, 5, 3, 7);
    r[0] = low;
  }
};

TESSERA_INLINE Float8 root(Float8 x) { return _mm256_sqrt_ps(x); }
TESSERA_INLINE Double4 root(Double4 x) { return _mm256_sqrt_pd(x); }
TESSERA_INLINE bool any(Float8 x) {
  return _mm256_movemask_ps(_mm256_cmp_ps(x, _mm256_setzero_ps(), _CMP_GT_OQ)) != 0;
}
TESSERA_INLINE bool any(Double4 x) {
  return _mm256_movemask_pd(_mm256_cmp_pd(x, _mm256_setzero_pd(), _CMP_GT_OQ)) != 0;
}
#endif

// The first kCount scalars behind each lane's pointer, a vector each.
template <typename L, int kCount>
TESSERA_INLINE void gather(const typename L::Scalar* const* from, typename L::Vector* to) {
  constexpr int kHalves = L::kWidth / L::kQuarter;
#pragma GCC unroll 8
  for (int c = 0; c < kCount; c += L::kQuarter) {
#pragma GCC unroll 8
    for (int i = 0; i < L::kQuarter; ++i) {
      typename L::Quarter quarters[kHalves];
#pragma GCC unroll 8
      for (int h = 0; h < kHalves; ++h)
        quarters[h] = *reinterpret_cast<const typename L::LooseQuarter*>(from[h * L::kQuarter + i] + c);
      to[c + i] = L::join(quarters);
    }
    L::transpose(to + c);
  }
}

// The reverse, where keep[lane] is not `none`; aligned like quarters.
template <typename L, int kCount, typename Key>
TESSERA_INLINE void scatter(typename L::Vector* from, typename L::Scalar* const* to, const Key* keep,
                            Key none) {
  constexpr int kHalves = L::kWidth / L::kQuarter;
#pragma GCC unroll 8
  for (int c = 0; c < kCount; c += L::kQuarter) L::transpose(from + c);
#pragma GCC unroll 8
  for (int h = 0; h < kHalves; ++h) {
#pragma GCC unroll 8
    for (int i = 0; i < L::kQuarter; ++i) {
      const int lane = h * L::kQuarter + i;
      if (keep[lane] == none) continue;
#pragma GCC unroll 8
      for (int c = 0; c < kCount; c += L::kQuarter)
        *reinterpret_cast<typename L::Quarter*>(to[lane] + c) = L::part(from[c + i], h);
    }
  }
}

}  // namespace
}  // namespace tessera
