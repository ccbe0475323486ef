// Reading CSV: against scanning the bytes once (memory bandwidth), against strtod and against bare from_chars
// per value.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include "whirl/io/csv.hpp"
#include "whirl/io/file.hpp"

namespace {

constexpr int kRows = 500000, kColumns = 4;

/// A run-down with full precision, as `write_csv` makes it: 500 000 rows of t, x, y, beta.
const std::string& text(int digits) {
  static std::string cache[2];
  std::string& out = cache[digits == 6 ? 0 : 1];
  if (out.empty()) {
    out = "t_s,x_m,y_m,beta_rad\n";
    for (int i = 0; i < kRows; ++i) {
      const double t = i / 1000.0, x = 1e-3 * std::sin(75.3 * t), y = 1e-3 * std::cos(75.3 * t), beta = 188 * t;
      out += digits == 6 ? fmt::format("{:.3f},{:.6g},{:.6g},{:.6g}\n", t, x, y, beta)
                         : fmt::format("{},{},{},{}\n", t, x, y, beta);
    }
  }
  return out;
}

void count(benchmark::State& state, const std::string& bytes) {
  state.SetBytesProcessed(static_cast<long>(state.iterations()) * static_cast<long>(bytes.size()));
  state.counters["values/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * kRows * kColumns, benchmark::Counter::kIsRate);
}

void scan_bytes(benchmark::State& state) {
  const std::string& bytes = text(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    long lines = 0;
    for (const char* p = bytes.data(); (p = static_cast<const char*>(std::memchr(
                                            p, '\n', static_cast<std::size_t>(bytes.data() + bytes.size() - p))));
         ++p)
      ++lines;
    benchmark::DoNotOptimize(lines);
  }
  count(state, bytes);
}

void bare_strtod(benchmark::State& state) {
  const std::string& bytes = text(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    double sum = 0;
    char* end = nullptr;
    for (const char* p = std::strchr(bytes.data(), '\n') + 1; *p; p = end + 1) sum += std::strtod(p, &end);
    benchmark::DoNotOptimize(sum);
  }
  count(state, bytes);
}

void bare_from_chars(benchmark::State& state) {
  const std::string& bytes = text(static_cast<int>(state.range(0)));
  const char* const last = bytes.data() + bytes.size();
  for (auto _ : state) {
    double sum = 0, value = 0;
    for (const char* p = std::strchr(bytes.data(), '\n') + 1; p < last;) {
      p = std::from_chars(p, last, value).ptr + 1;
      sum += value;
    }
    benchmark::DoNotOptimize(sum);
  }
  count(state, bytes);
}

void parse_csv(benchmark::State& state) {
  const std::string& bytes = text(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(whirl::io::parse_csv(bytes, "bench.csv").channels.data());
  count(state, bytes);
}

void parse_decimal_commas(benchmark::State& state) {
  std::string bytes = text(static_cast<int>(state.range(0)));
  for (char& c : bytes) c = c == ',' ? ';' : c == '.' ? ',' : c;
  for (auto _ : state) benchmark::DoNotOptimize(whirl::io::parse_csv(bytes, "bench.csv").channels.data());
  count(state, bytes);
}

void read_gzip(benchmark::State& state) {
  const std::string& bytes = text(static_cast<int>(state.range(0)));
  const auto file = std::filesystem::temp_directory_path() / "whirl_bench_io.csv.gz";
  whirl::io::write_text(file, bytes);
  for (auto _ : state) benchmark::DoNotOptimize(whirl::io::read_csv(file).channels.data());
  std::filesystem::remove(file);
  count(state, bytes);
}

void write_csv(benchmark::State& state) {
  const std::string& bytes = text(17);
  const whirl::Recording record = whirl::io::parse_csv(bytes, "bench.csv");
  const auto file = std::filesystem::temp_directory_path() / "whirl_bench_io.csv";
  for (auto _ : state) whirl::io::write_csv(file, record);
  std::filesystem::remove(file);
  count(state, bytes);
}

BENCHMARK(scan_bytes)->Arg(6)->Arg(17)->Unit(benchmark::kMillisecond);
BENCHMARK(bare_strtod)->Arg(6)->Arg(17)->Unit(benchmark::kMillisecond);
BENCHMARK(bare_from_chars)->Arg(6)->Arg(17)->Unit(benchmark::kMillisecond);
BENCHMARK(parse_csv)->Arg(6)->Arg(17)->Unit(benchmark::kMillisecond);
BENCHMARK(parse_decimal_commas)->Arg(6)->Arg(17)->Unit(benchmark::kMillisecond);
BENCHMARK(read_gzip)->Arg(6)->Unit(benchmark::kMillisecond);
BENCHMARK(write_csv)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
