// Arrays as they stand in a file: read whole, or some of their rows.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "formats/arrays/arrays.hpp"
#include "whirl/core/error.hpp"

namespace whirl::io {
namespace {

constexpr std::size_t kFew = 65536;                            // values beside a record
constexpr std::size_t kUnpackedBeside = std::size_t{1} << 24;  // bytes of a packed array beside a record

std::size_t longest_side(const StoredArray& array) {
  return array.shape.empty() ? 1 : *std::max_element(array.shape.begin(), array.shape.end());
}

bool fits(const StoredArray& array, Eigen::Index rows) {
  const auto n = static_cast<std::size_t>(rows);
  return array.shape.size() <= 2 && std::find(array.shape.begin(), array.shape.end(), n) != array.shape.end();
}

class ArrayRows : public RowReader {
 public:
  ArrayRows(const std::filesystem::path& path, ReadArrays arrays) {
    arrays(std::make_shared<RandomBytes>(path), kUnpackedBeside, file_,
           [&](StoredArray&& array) { arrays_.push_back(std::move(array)); });
    rows_ = rows_of_record(arrays_, file_);
  }
  std::string name() const override { return file_.source; }
  Eigen::Index rows() const override { return rows_; }
  SignalFile read(Eigen::Index first, Eigen::Index count) override {
    SignalFile file = file_;
    std::vector<NamedArray> loaded;
    for (const StoredArray& array : arrays_)
      loaded.push_back(array.size() == 1 ? array.load() : array.load(first, count, rows_));
    add_arrays(file, std::move(loaded));
    return file;
  }

 private:
  SignalFile file_;
  std::vector<StoredArray> arrays_;
  Eigen::Index rows_ = 0;
};

}  // namespace

std::size_t StoredArray::size() const {
  return std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
}

NamedArray StoredArray::load() const {
  NamedArray array = head;
  const auto numbers = [&](const StoredPart& part) {
    StoredNumbers stored(part.type, big);
    stored.add({.at = part.at, .rows = size(), .width = part.width, .offset = part.offset});
    return stored.read(*in, 0, stored.count());
  };
  set_values(array, numbers(real), imaginary ? numbers(*imaginary) : Eigen::VectorXd(), shape, columns_first);
  return array;
}

NamedArray StoredArray::load(Eigen::Index first, Eigen::Index count, Eigen::Index rows) const {
  const std::size_t n = static_cast<std::size_t>(rows), others = size() / n;
  const bool first_side = shape[0] == n;
  // Values from one row to the next, and from one column to the next.
  const std::uint64_t step = first_side == columns_first ? 1 : others, across = first_side == columns_first ? n : 1;
  const auto numbers = [&](const StoredPart& part) {
    Eigen::MatrixXd m(count, static_cast<Eigen::Index>(others));
    for (std::size_t c = 0; c < others; ++c) {
      StoredNumbers stored(part.type, big);
      const std::uint64_t column = c * across * part.width;
      stored.add({.at = part.at + (step == 1 ? column : 0),
                  .rows = n,
                  .width = step * part.width,
                  .offset = part.offset + (step == 1 ? 0 : column)});
      m.col(static_cast<Eigen::Index>(c)) = stored.read(*in, first, count);
    }
    return m;
  };
  NamedArray array = head;
  array.value = numbers(real);
  if (imaginary) array.imaginary = numbers(*imaginary);
  StoredNumbers ends(real.type, big);
  ends.add({.at = real.at, .rows = n, .width = real.width, .offset = real.offset});
  array.part = {first, rows, ends.read(*in, 0, 1)[0], ends.read(*in, rows - 1, 1)[0]};
  return array;
}

SignalFile read_arrays(const std::shared_ptr<const RandomBytes>& bytes, ReadArrays read,
                       const ResponseOptions* wanted) {
  SignalFile file;
  std::vector<NamedArray> loaded;
  read(bytes, std::numeric_limits<std::size_t>::max(), file,
       [&](StoredArray&& array) { loaded.push_back(array.load()); });
  add_arrays(file, std::move(loaded), wanted);
  tell_rounding(file);
  return file;
}

std::unique_ptr<SignalStream> stream_arrays(const std::filesystem::path& path, ReadArrays read, const PartRows& rows) {
  return stream_rows(std::make_unique<ArrayRows>(path, read), rows);
}

Eigen::Index rows_of_record(std::vector<StoredArray>& arrays, SignalFile& file) {
  std::size_t rows = 0;
  for (const StoredArray& array : arrays) rows = std::max(rows, longest_side(array));
  for (const StoredArray& array : arrays)
    if (names_time(array.head) && array.size() == longest_side(array) && array.size() > 1) rows = array.size();
  std::erase_if(arrays, [&](const StoredArray& array) {
    if (array.size() == 1 || fits(array, static_cast<Eigen::Index>(rows))) return false;
    const std::string what = fmt::format("'{}' has {} values, the record {}", array.head.name, array.size(), rows);
    if (array.size() > kFew)
      throw Error::in_file(file.source, 0, what + " samples: such a file cannot be read in parts, only whole");
    file.findings.push_back(what + " samples: left out, as the file is read in parts");
    return true;
  });
  return static_cast<Eigen::Index>(rows);
}

void note_rounding(SignalFile& file, const std::string& name, const Eigen::Ref<const Eigen::MatrixXd>& values) {
  const Eigen::Index beyond = (values.array().abs() >= 9007199254740992.0).count();
  if (beyond > 0) file.rounded.push_back({name, beyond, values.size()});
}

void tell_rounding(SignalFile& file) {
  for (const RoundedIntegers& r : file.rounded)
    file.findings.push_back(
        fmt::format("'{}': {} of {} integers are 2^53 or more: rounded to 53 bits", r.name, r.count, r.of));
  file.rounded.clear();
}

}  // namespace whirl::io
