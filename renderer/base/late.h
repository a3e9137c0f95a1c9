// Room for a value that is made later, if at all.
#pragma once

#include <memory>
#include <type_traits>
#include <utility>

namespace helio {

// As std::optional, for large values in inner loops: g++ 12 fills all of an empty std::optional with zeros.
template <class T>
class Late {
  static_assert(std::is_trivially_destructible_v<T>);

 public:
  Late() {}
  Late(const Late&) = delete;
  Late& operator=(const Late&) = delete;

  template <class... Args>
  T& emplace(Args&&... args) {
    std::construct_at(&value_, std::forward<Args>(args)...);
    made_ = true;
    return value_;
  }

  // As it was before emplace().
  void reset() { made_ = false; }

  explicit operator bool() const { return made_; }
  // Only where it has been made.
  const T& operator*() const { return value_; }
  const T* operator->() const { return &value_; }

  const T* get() const { return made_ ? &value_ : nullptr; }

 private:
  union {
    T value_;
  };
  bool made_ = false;
};

}  // namespace helio
