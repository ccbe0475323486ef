// What is wrong with a record, before anything is fitted to it. Usage: check_record FILE
#include <cstdio>
#include <whirl/records/check.hpp>
#include <whirl/whirl.hpp>

int main(int argc, char** argv) try {
  if (argc != 2) return 2;
  const whirl::records::RecordReport report = whirl::records::check(whirl::io::read(argv[1]));
  for (const whirl::records::Finding& finding : report.findings) std::printf("%s\n", finding.text().c_str());
  std::printf("%zu findings\n", report.findings.size());
} catch (const whirl::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
