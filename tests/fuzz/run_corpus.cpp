// Runs a fuzz target without libFuzzer: every file of a folder as it is, then seeded random mutations of
// each. Usage: fuzz_csv <folder> [seconds [seed]], 2 seconds when not stated. A crash, 5 s of processor time or 1 GiB
// of memory is a failure; its input is written to crash.bin.
#include <sys/resource.h>
#include <sys/time.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

std::string current;

void write_crash(int signal) {
  if (std::FILE* f = std::fopen("crash.bin", "wb")) {
    std::fwrite(current.data(), 1, current.size(), f);
    std::fclose(f);
  }
  std::fputs("failing input written to crash.bin\n", stderr);
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

constexpr int kLongest = 5;             // s of processor time for one input
constexpr long kMostMemory = 1L << 20;  // KiB that the process has ever held, for inputs below 1 MiB

void too_long(int) {
  std::fprintf(stderr, "an input takes more than %d s\n", kLongest);
  write_crash(SIGABRT);
}

void run(std::string input) {
  current = std::move(input);
  const itimerval limit{{0, 0}, {kLongest, 0}};
  setitimer(ITIMER_PROF, &limit, nullptr);
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(current.data()), current.size());
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  if (current.size() < std::size_t{1} << 20 && used.ru_maxrss > kMostMemory) {
    std::fprintf(stderr, "an input of %zu bytes needs %ld MiB\n", current.size(), used.ru_maxrss >> 10);
    write_crash(SIGABRT);
  }
}

/// One to eight edits: bytes changed, cut, doubled, exchanged with another input, or replaced by awkward
/// pieces.
std::string mutate(std::string s, const std::vector<std::string>& corpus, std::mt19937_64& random) {
  static const std::vector<std::string> kPieces{"nan",
                                                "inf",
                                                "-",
                                                "+",
                                                ".",
                                                ",",
                                                ";",
                                                "\t",
                                                "\"",
                                                "\n",
                                                "\r\n",
                                                "\n\n",
                                                "#",
                                                "_",
                                                ":",
                                                "e",
                                                "1e999",
                                                "1e-999",
                                                "0",
                                                "-0",
                                                "9223372036854775808",
                                                "null",
                                                "{",
                                                "}",
                                                "[",
                                                "]",
                                                "[[",
                                                "]]",
                                                "=",
                                                "\\u0000",
                                                "\\",
                                                std::string(1, '\0'),
                                                "\xff\xfe",
                                                "\xef\xbb\xbf",
                                                "\xc3\x28",
                                                "\x1f\x8b",
                                                "(",
                                                ")",
                                                "^",
                                                "*",
                                                "sin(",
                                                "1.5",
                                                "t_s",
                                                "x_mm",
                                                "1e",
                                                "0x1p3"};
  const auto below = [&](std::size_t n) { return n == 0 ? 0 : random() % n; };
  for (std::size_t edits = 1 + below(8); edits > 0; --edits) {
    const std::size_t at = below(s.size() + 1);
    const std::size_t length = std::min(s.size() - at, std::size_t{1} + below(below(4) == 0 ? 200 : 8));
    switch (below(7)) {
      case 0:
        if (at < s.size()) s[at] = static_cast<char>(s[at] ^ (1 << below(8)));
        break;
      case 1:
        if (at < s.size()) s[at] = static_cast<char>(below(256));
        break;
      case 2:
        s.erase(at, length);
        break;
      case 3:
        s.insert(at, s.substr(at, length));
        break;
      case 4:
        s.insert(at, kPieces[below(kPieces.size())]);
        break;
      case 5:
        s.replace(at, length, kPieces[below(kPieces.size())]);
        break;
      case 6: {
        const std::string& other = corpus[below(corpus.size())];
        const std::size_t from = below(other.size() + 1);
        s.replace(at, length, other.substr(from, 1 + below(64)));
        break;
      }
    }
  }
  return s;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS}) std::signal(signal, write_crash);
  std::signal(SIGPROF, too_long);
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1])) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<std::string> corpus;
  for (const auto& file : files) {
    std::ifstream in(file, std::ios::binary);
    corpus.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  if (corpus.empty()) {
    std::fprintf(stderr, "no files in %s\n", argv[1]);
    return 2;
  }
  for (const std::string& input : corpus) run(input);
  for (std::size_t cut = 0; cut <= 2000; ++cut) {
    for (const std::string& input : corpus) {
      if (cut <= input.size()) run(input.substr(0, input.size() * cut / 2000));
    }
  }
  // The inputs are seeded; only their number depends on the time allowed.
  const double seconds = argc > 2 ? std::atof(argv[2]) : 2;
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  std::mt19937_64 random(argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 20240501);
  long count = 0;
  while (std::chrono::steady_clock::now() < end) {
    for (int i = 0; i < 50; ++i, ++count) run(mutate(corpus[random() % corpus.size()], corpus, random));
  }
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  std::printf("%zu files, %ld mutations, %ld MiB\n", corpus.size(), count, used.ru_maxrss >> 10);
  return 0;
}
