#pragma once
#include <cstdint>
#include <type_traits>

namespace whirl {

/// Value or fault of the real-time path: trivially copyable, never throws, never allocates.
/// (`std::expected` is C++23.) `E{}` must mean "no fault".
template <class T, class E>
class Expected {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_copyable_v<E>);

 public:
  constexpr Expected(const T& value) noexcept : value_(value), error_{}, ok_(true) {}
  static constexpr Expected fault(E error) noexcept {
    Expected e{T{}};
    e.error_ = error;
    e.ok_ = false;
    return e;
  }
  constexpr explicit operator bool() const noexcept { return ok_; }
  constexpr const T& operator*() const noexcept { return value_; }
  constexpr const T* operator->() const noexcept { return &value_; }
  constexpr E error() const noexcept { return error_; }

 private:
  T value_;
  E error_;
  bool ok_;
};

}  // namespace whirl
