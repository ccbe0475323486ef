#pragma once
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace whirl::testing {

/// One page in a headless Chromium, driven through the DevTools protocol. Whatever happens, the browser is ended with
/// this object, or after two minutes without a call.
class Browser {
 public:
  /// The program, or empty where there is none.
  static std::filesystem::path program();

  /// `width` x `height` in CSS pixels.
  explicit Browser(const std::filesystem::path& folder, int width = 1400, int height = 2200);
  ~Browser();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  void open(const std::string& url);
  /// Value of a JavaScript expression. Throws std::runtime_error when it throws.
  nlohmann::json evaluate(const std::string& expression);
  std::string text(const std::string& id) {
    return evaluate("document.getElementById('" + id + "').textContent").get<std::string>();
  }
  /// Evaluates until the expression is true, as long as `await` has patience.
  bool wait(const std::string& expression);
  void key(const std::string& key);
  /// Presses the mouse in the middle of an element.
  void click(const std::string& selector);
  void dark(bool on);
  /// Lays the page out as on paper, `width` CSS pixels wide.
  void on_paper(int width);
  void resize(int width, int height, bool touch);
  void screenshot(const std::filesystem::path& file);

  /// Addresses asked for by the page since open().
  const std::vector<std::string>& requests() const { return requests_; }
  /// Exceptions, refused resources and console errors of the page since open().
  const std::vector<std::string>& complaints() const { return complaints_; }

 private:
  struct Process;
  nlohmann::json call(const std::string& method, const nlohmann::json& parameters = nlohmann::json::object());
  void note(const nlohmann::json& event);

  std::unique_ptr<Process> process_;
  std::string session_;
  int next_ = 1;
  std::vector<std::string> requests_, complaints_;
};

}  // namespace whirl::testing
