#pragma once
#include <cstring>

namespace whirl::rig {

// The widest vector of this processor; in the sources only, so that the interface does not depend on it.
#if defined(__AVX512F__)
constexpr int kWidth = 8;
#elif defined(__AVX__)
constexpr int kWidth = 4;
#else
constexpr int kWidth = 2;
#endif
typedef double Vector __attribute__((vector_size(kWidth * sizeof(double))));

inline Vector load(const double* p) {
  Vector v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
inline void store(double* p, Vector v) { std::memcpy(p, &v, sizeof v); }

// To the nearest multiple of lsb; exact for |v / lsb| < 2^51.
inline Vector quantised(Vector v, double lsb) {
  constexpr double kRound = 0x1.8p52;
  return ((v * (1 / lsb) + kRound) - kRound) * lsb;
}
inline Vector clamped(Vector v, Vector high) {
  const Vector low = -high;
  v = v > high ? high : v;
  return v < low ? low : v;
}
inline Vector clamped(Vector v, double limit) { return clamped(v, Vector{} + limit); }

}  // namespace whirl::rig
