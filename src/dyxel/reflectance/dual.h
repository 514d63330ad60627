// Dual numbers: a value with its derivatives by N variables, so that a function written for
// `Real T` gives its gradient too (forward-mode differentiation). The value may be a scalar or
// lanes. Inlined by force: at -O2 the compiler would call them, lanes in memory.
#pragma once

#include <array>
#include <cmath>

#include "dyxel/base/lanes.h"

namespace dyxel {

template <int N, Real T = double>
struct Dual {
  T value = T(0);
  std::array<T, N> d{};  // ∂value / ∂variable i

  Dual() { d.fill(T(0)); }
  Dual(const T& v) : value(v) { d.fill(T(0)); }  // NOLINT: a constant is a dual without slope
  explicit Dual(ScalarOf<T> v) requires(!std::same_as<ScalarOf<T>, T>) : value(v) { d.fill(T(0)); }
  // Variable `i` at `v`.
  static Dual Variable(const T& v, int i) {
    Dual x(v);
    x.d[static_cast<std::size_t>(i)] = T(1);
    return x;
  }

  // f(value) with the slope f'(value): the chain rule.
  [[nodiscard, gnu::always_inline]] Dual Chain(const T& f, const T& slope) const {
    Dual y(f);
    for (std::size_t i = 0; i < N; ++i) y.d[i] = slope * d[i];
    return y;
  }

  // f(value) of slope 1.
  [[nodiscard, gnu::always_inline]] Dual Chain1(const T& f) const {
    Dual y = *this;
    y.value = f;
    return y;
  }

  [[gnu::always_inline]] friend Dual operator-(const Dual& a) { return a.Chain(-a.value, T(-1)); }
  [[gnu::always_inline]] friend Dual operator+(const Dual& a, const Dual& b) {
    Dual y(a.value + b.value);
    for (std::size_t i = 0; i < N; ++i) y.d[i] = a.d[i] + b.d[i];
    return y;
  }
  [[gnu::always_inline]] friend Dual operator-(const Dual& a, const Dual& b) {
    Dual y(a.value - b.value);
    for (std::size_t i = 0; i < N; ++i) y.d[i] = a.d[i] - b.d[i];
    return y;
  }
  [[gnu::always_inline]] friend Dual operator*(const Dual& a, const Dual& b) {
    Dual y(a.value * b.value);
    for (std::size_t i = 0; i < N; ++i) y.d[i] = a.d[i] * b.value + a.value * b.d[i];
    return y;
  }
  [[gnu::always_inline]] friend Dual operator/(const Dual& a, const Dual& b) {
    const T inverse = T(1) / b.value;
    Dual y(a.value * inverse);
    for (std::size_t i = 0; i < N; ++i) y.d[i] = (a.d[i] - y.value * b.d[i]) * inverse;
    return y;
  }
  [[gnu::always_inline]] friend Dual operator*(const Dual& a, const T& b) {
    return a.Chain(a.value * b, b);
  }
  [[gnu::always_inline]] friend Dual operator*(const T& a, const Dual& b) {
    return b.Chain(a * b.value, a);
  }
  [[gnu::always_inline]] friend Dual operator+(const Dual& a, const T& b) {
    return a.Chain1(a.value + b);
  }
  [[gnu::always_inline]] friend Dual operator+(const T& a, const Dual& b) {
    return b.Chain1(a + b.value);
  }
  [[gnu::always_inline]] friend Dual operator-(const Dual& a, const T& b) {
    return a.Chain1(a.value - b);
  }
  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }
  Dual& operator/=(const Dual& b) { return *this = *this / b; }

  // Comparisons are those of the values.
  friend auto operator<(const Dual& a, const Dual& b) { return a.value < b.value; }
  friend auto operator<=(const Dual& a, const Dual& b) { return a.value <= b.value; }

  [[gnu::always_inline]] friend Dual exp(const Dual& x) {
    const T y = Exp(x.value);
    return x.Chain(y, y);
  }
  [[gnu::always_inline]] friend Dual log(const Dual& x) {
    return x.Chain(Log(x.value), T(1) / x.value);
  }
  [[gnu::always_inline]] friend Dual sqrt(const Dual& x) {
    const T y = Sqrt(x.value);
    return x.Chain(y, T(1) / (y + y));
  }
};

template <int N, Real T>
struct LaneTraits<Dual<N, T>> {
  using Scalar = ScalarOf<T>;
  using Mask = MaskOf<T>;
  static constexpr int kCount = kLaneCount<T>;
};

template <int N, Real T>
[[gnu::always_inline]] inline Dual<N, T> Select(const MaskOf<T>& mask,
                                                const Dual<N, T>& a,
                                                const Dual<N, T>& b) {
  Dual<N, T> y(Select(mask, a.value, b.value));
  for (std::size_t i = 0; i < N; ++i) y.d[i] = Select(mask, a.d[i], b.d[i]);
  return y;
}

}  // namespace dyxel
