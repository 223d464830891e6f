// How numbers come through the door: a pointer and its size, made from whatever holds numbers side
// by side (Eigen vectors and matrices, std::vector, std::array, std::span). No Eigen type crosses
// into the compiled library: the alignment of Eigen's types depends on the flags of the compiler
// that sees them. What is not side by side (an expression, a row of a column-major matrix) is
// refused: by the compiler where it can tell, else by an exception.
#pragma once

#include <concepts>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

namespace kalmarm {

namespace detail {

template <class V>
concept Shaped = requires(V& v) {
  { v.rows() } -> std::convertible_to<std::ptrdiff_t>;
  { v.cols() } -> std::convertible_to<std::ptrdiff_t>;
};

// Holds numbers of type T (which may be const) side by side.
template <class V, class T>
concept Holds = requires(V& v) {
  { v.data() } -> std::convertible_to<T*>;
  { v.size() } -> std::convertible_to<std::ptrdiff_t>;
};

template <class V>
constexpr bool is_row_major = requires {
  requires static_cast<bool>(std::decay_t<V>::IsRowMajor);
};

// A matrix that is stored by columns; of one column it is a vector.
template <class V>
concept ColumnMajor =
    Shaped<V> && !is_row_major<V> && !static_cast<bool>(std::decay_t<V>::IsVectorAtCompileTime);

// An Eigen matrix, block or map without gaps between its numbers.
template <class V>
bool has_no_gaps(const V& v) {
  if constexpr (requires { v.innerStride(), v.outerStride(); }) {
    const bool inner = v.size() <= 1 || v.innerStride() == 1;
    const std::ptrdiff_t width = is_row_major<V> ? v.cols() : v.rows();
    return inner && (v.rows() <= 1 || v.cols() <= 1 || v.outerStride() == width);
  } else {
    return true;
  }
}

inline std::string shape(std::ptrdiff_t rows, std::ptrdiff_t columns) {
  return std::to_string(rows) + " x " + std::to_string(columns);
}

}  // namespace detail

// One vector.
template <class T>
class VectorView {
 public:
  VectorView(T* data, std::ptrdiff_t size) : data_(data), size_(size) {}

  template <class V>  // a copy by it holds the same
  // NOLINTNEXTLINE(bugprone-forwarding-reference-overload)
  requires detail::Holds<V, T> VectorView(V&& v)
      : data_(v.data()), size_(static_cast<std::ptrdiff_t>(v.size())) {
    if (!detail::has_no_gaps(v))
      throw std::invalid_argument("a vector with gaps between its numbers");
  }

  T* data() const { return data_; }
  std::ptrdiff_t size() const { return size_; }

 private:
  T* data_;
  std::ptrdiff_t size_;
};

// One state a row: a row-major matrix, or numbers side by side, a vector, whose count of rows
// follows from the width that is needed.
template <class T>
class RowsView {
  template <class V>
  static constexpr bool is_rows =
      std::is_same_v<std::remove_cvref_t<V>, RowsView<T>> ||
      std::is_same_v<std::remove_cvref_t<V>, RowsView<std::remove_const_t<T>>>;
  friend class RowsView<const T>;

 public:
  RowsView(T* data, std::ptrdiff_t rows, std::ptrdiff_t width)
      : data_(data), rows_(rows), width_(width), size_(rows * width) {}

  // Of rows that may be written those that may only be read.
  template <std::same_as<std::remove_const_t<T>> U>
  requires std::is_const_v<T> RowsView(const RowsView<U>& rows)
      : data_(rows.data_), rows_(rows.rows_), width_(rows.width_), size_(rows.size_) {}

  template <class V>
  requires(detail::Holds<V, T> && !detail::ColumnMajor<V> && !is_rows<V>)
      RowsView(V&& v)  // NOLINT(bugprone-forwarding-reference-overload): of no view, by !is_rows
      : data_(v.data()), size_(static_cast<std::ptrdiff_t>(v.size())) {
    if constexpr (detail::is_row_major<V>) {
      rows_ = v.rows();
      width_ = v.cols();
    }
    if (!detail::has_no_gaps(v))
      throw std::invalid_argument("rows with gaps between their numbers");
  }

  // One state a row: take a row-major matrix.
  template <class V>
  // NOLINTNEXTLINE(bugprone-forwarding-reference-overload)
  requires(detail::Holds<V, T>&& detail::ColumnMajor<V>) RowsView(V&& v)
  = delete;

  T* data() const { return data_; }
  std::ptrdiff_t size() const { return size_; }
  bool is_shaped() const { return rows_ >= 0; }  // else only size() is known
  bool fits(std::ptrdiff_t rows, std::ptrdiff_t width) const {
    return is_shaped() ? rows_ == rows && width_ == width : size_ == rows * width;
  }
  std::string shape() const {
    return is_shaped() ? detail::shape(rows_, width_) : std::to_string(size_);
  }

 private:
  T* data_;
  std::ptrdiff_t rows_ = -1, width_ = -1, size_;
};

// A column-major matrix, or, where it is symmetric, a row-major one.
template <class T>
class MatrixView {
 public:
  MatrixView() = default;  // none
  MatrixView(T* data, std::ptrdiff_t rows, std::ptrdiff_t cols)
      : data_(data), rows_(rows), cols_(cols), size_(rows * cols) {}

  template <class V>  // of no MatrixView, which has no size()
  // NOLINTNEXTLINE(bugprone-forwarding-reference-overload)
  requires detail::Holds<V, T> MatrixView(V&& v)
      : data_(v.data()),
        size_(static_cast<std::ptrdiff_t>(v.size())),
        row_major_(detail::is_row_major<V>) {
    if constexpr (detail::Shaped<V>) {
      rows_ = v.rows();
      cols_ = v.cols();
    }
    if (!detail::has_no_gaps(v))
      throw std::invalid_argument("a matrix with gaps between its numbers");
  }

  explicit operator bool() const { return data_; }
  T* data() const { return data_; }
  bool is_row_major() const { return row_major_; }
  // How many columns of so many rows: those it has, or what follows from its size.
  std::ptrdiff_t columns_of(std::ptrdiff_t rows) const {
    return rows_ >= 0 ? cols_ : rows > 0 ? size_ / rows : 0;
  }
  // How many rows of so many columns.
  std::ptrdiff_t rows_of(std::ptrdiff_t cols) const {
    return rows_ >= 0 ? rows_ : cols > 0 ? size_ / cols : 0;
  }
  bool fits(std::ptrdiff_t rows, std::ptrdiff_t cols) const {
    return rows_ >= 0 ? rows_ == rows && cols_ == cols : size_ == rows * cols;
  }
  std::string shape() const {
    return rows_ >= 0 ? detail::shape(rows_, cols_) : std::to_string(size_);
  }

 private:
  T* data_ = nullptr;
  std::ptrdiff_t rows_ = -1, cols_ = -1, size_ = 0;
  bool row_major_ = false;
};

}  // namespace kalmarm
