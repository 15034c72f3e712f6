#pragma once

// The part of std::span that headers of this suite use, for C++17, where libstdc++'s header <span> is empty. Siconos'
// headers require C++17 (CMakeLists.txt). Layout and meaning are those of C++20.

#include <cstddef>
#include <span>
#include <type_traits>

#if __cplusplus < 202002L
namespace std {

template <class T>
class span {
 public:
  span() = default;
  span(T* data, size_t size) : data_(data), size_(size) {}
  template <class Container, class = enable_if_t<is_convertible_v<decltype(declval<Container&>().data()), T*>>>
  span(Container&& container) : data_(container.data()), size_(container.size()) {}

  T* data() const { return data_; }
  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  T* begin() const { return data_; }
  T* end() const { return data_ + size_; }
  T& front() const { return *data_; }
  T& operator[](size_t k) const { return data_[k]; }
  span first(size_t n) const { return {data_, n}; }

 private:
  T* data_ = nullptr;
  size_t size_ = 0;
};

template <class Container>
span(Container&) -> span<remove_pointer_t<decltype(declval<Container&>().data())>>;

}  // namespace std
#endif
