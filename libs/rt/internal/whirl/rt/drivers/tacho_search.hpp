#pragma once
#include <cstddef>
#include <vector>

namespace whirl::rt {

/// Which mark of a tacho an edge was, from the times of the last edges alone: a turn of them and four more, none lost
/// or added, through which a constant acceleration leads. Nothing here allocates but the constructor.
class TachoSearch {
 public:
  /// `marks` as TachoMarks::marks.
  TachoSearch(const std::vector<double>& marks, double sample_time);

  /// Edges before are no neighbours of those that come.
  void clear() noexcept { known_ = 0; }
  void edge(double time) noexcept;  ///< s
  bool full() const noexcept { return known_ == times_.size(); }

  struct Found {
    bool steady = false;                 ///< some mark fits
    bool unique = false;                 ///< and no other one does
    std::size_t mark = 0;                ///< of the newest edge
    double speed = 0, acceleration = 0;  ///< there, 1/s, 1/s^2
  };
  /// With `full()`.
  Found look() noexcept;

 private:
  double place(std::size_t newest, std::size_t back) const noexcept;  ///< turns, `back` marks before that mark

  std::vector<double> marks_, times_;  ///< a ring, s
  std::vector<double> line_, curve_;   ///< of the edges, oldest first: orthogonal polynomials of their times
  double sample_time_, least_room_;
  std::size_t next_ = 0, known_ = 0;
};

}  // namespace whirl::rt
