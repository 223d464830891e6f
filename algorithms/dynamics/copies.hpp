// Copies of chosen entries of vectors and matrices, settled once.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace kalmarm {

// Copies of entries, as runs of neighbours.
class Copies {
 public:
  void add(int from, int to) {
    if (!runs_.empty() && from == runs_.back().from + runs_.back().count &&
        to == runs_.back().to + runs_.back().count)
      ++runs_.back().count;
    else
      runs_.push_back({from, to, 1});
  }

  template <class T>
  void operator()(const T* from, T* to) const {
    for (const Run& run : runs_) std::copy_n(from + run.from, run.count, to + run.to);
  }

  // The other way.
  template <class T>
  void back(const T* to, T* from) const {
    for (const Run& run : runs_) std::copy_n(to + run.to, run.count, from + run.from);
  }

  // A block of a column-major matrix, rows and columns alike, to one of another height.
  template <class T>
  void block(const T* from, int from_height, T* to, int to_height) const {
    for (const Run& column : runs_)
      for (int j = 0; j < column.count; ++j)
        for (const Run& row : runs_)
          std::copy_n(from + std::ptrdiff_t(column.from + j) * from_height + row.from, row.count,
                      to + std::ptrdiff_t(column.to + j) * to_height + row.to);
  }

 private:
  struct Run {
    int from, to, count;
  };
  std::vector<Run> runs_;
};

}  // namespace kalmarm
