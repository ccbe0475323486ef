#include "whirl/pages/printed_page.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/core/tell.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/run_program.hpp"
#include "whirl/io/temporary.hpp"

namespace whirl::pages {
namespace {

constexpr unsigned kNobody = 65534;

/// Exit code of the first browser found, 127 when there is none. Nothing is loaded from anywhere: the page is one file.
int print(const std::filesystem::path& folder, bool sandbox) {
  std::vector<std::string> prefix;
  // A browser refuses to be root in its sandbox: it runs as nobody, who owns the folder and nothing else.
  if (sandbox && ::geteuid() == 0) {
    prefix = {"setpriv", fmt::format("--reuid={}", kNobody), fmt::format("--regid={}", kNobody), "--clear-groups",
              "env",     "HOME=" + folder.string()};
  }
  for (const char* browser : {"chromium", "chromium-browser", "google-chrome"}) {
    std::vector<std::string> call = prefix;
    call.insert(call.end(),
                {browser, "--headless", "--disable-gpu", "--disable-quic", "--no-first-run",
                 "--disable-background-networking", "--disable-component-update", "--disable-sync",
                 "--no-pdf-header-footer", "--user-data-dir=" + (folder / "profile").string(),
                 "--print-to-pdf=" + (folder / "page.pdf").string(), "file://" + (folder / "page.html").string()});
    if (!sandbox) call.push_back("--no-sandbox");
    const int code = io::run_program(call);
    if (code != 127) return code;
  }
  return 127;
}

bool complete_pdf(const std::string& bytes) {
  return bytes.starts_with("%PDF-") &&
         bytes.find("%%EOF", bytes.size() - std::min<std::size_t>(bytes.size(), 32)) != std::string::npos;
}

}  // namespace

std::string printed_page(const std::string& page, const std::filesystem::path& pdf) {
  const io::TemporaryFolder temporary("print");
  const std::filesystem::path& folder = temporary.path();
  io::write_text(folder / "page.html", page);
  if (::geteuid() == 0) {
    (void)!::chown(folder.c_str(), kNobody, kNobody);
    (void)!::chown((folder / "page.html").c_str(), kNobody, kNobody);
  }
  const auto printed = [&] {
    return std::filesystem::exists(folder / "page.pdf") ? io::read_text(folder / "page.pdf") : std::string();
  };
  int code = print(folder, true);
  std::string bytes = printed();
  if (code != 0 || !complete_pdf(bytes)) {
    std::filesystem::remove_all(folder / "profile");
    std::filesystem::remove(folder / "page.pdf");
    code = print(folder, false);
    bytes = printed();
    if (code == 0)
      tell(
          "whirl: the browser's sandbox does not start here (it needs user namespaces); the page, which loads "
          "nothing, is printed without it\n");
  }
  if (code == 127) {
    throw Error(
        "--pdf needs the browser chromium (Debian: apt install chromium); without it write the page alone, open it "
        "in any browser and print it: the page is made for paper");
  }
  if (code != 0 || !complete_pdf(bytes))
    throw Error::in_file(pdf.string(), 0, fmt::format("the browser made no complete PDF (exit code {})", code));
  return bytes;
}

}  // namespace whirl::pages
