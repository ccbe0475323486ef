#include <fmt/format.h>

#include "command.hpp"
#include "command_texts.hpp"
#include "whirl/io/output.hpp"

namespace whirl::app {
namespace {

void collect(const CommandText& command, std::vector<io::FileText>& files) {
  files.push_back({page_name(command) + ".1", manual_page(command, std::string(version()))});
  for (const CommandText& child : command.children) collect(child, files);
}

std::string reference(const CommandText& command) {
  std::string text = markdown_page(command);
  for (const CommandText& child : command.children) text += reference(child);
  return text;
}

}  // namespace

void add_manual(CommandLine& app, Session& session) {
  struct Options {
    std::string out, format = "man", shell;
  };
  auto o = std::make_shared<Options>();
  CommandLine* manual = add_command(
      app, session, "manual", "Manual pages of every subcommand, or one reference in Markdown",
      "Output: OUT/whirl.1, OUT/whirl-identify.1, ...; with --format markdown one text on stdout. It is the text of "
      "--help-all.\n\n"
      "Example: whirl manual --out man1 && man ./man1/whirl-identify.1",
      [o, &app, &session] {
        const CommandText text = app.describe();
        if (o->format == "markdown") {
          fmt::print("# Subcommands\n\n{}", reference(text));
          return;
        }
        if (o->out.empty()) throw Error("manual: --out FOLDER is needed for manual pages");
        std::vector<io::FileText> files;
        collect(text, files);
        for (const io::FileText& file : files) session.check_output(std::filesystem::path(o->out) / file.name, "text");
        io::write_files(o->out, files);
        session.say(fmt::format("{}: {} pages", o->out, files.size()));
      });
  manual->add_option("--out", o->out, "folder of the manual pages")->output_folder();
  manual->add_option("--format", o->format, "man (default) or markdown")->one_of({"man", "markdown"});
  CommandLine* shell =
      add_command(app, session, "completion", "Completion of subcommands, flags and their values for a shell",
                  "Output: a script on stdout. The Debian package installs it for all three shells.\n\n"
                  "Example: source <(whirl completion bash)\n"
                  "         whirl completion fish > ~/.config/fish/completions/whirl.fish",
                  [o, &app] { fmt::print("{}", completion(app.describe(), o->shell)); });
  shell->add_option("SHELL", o->shell, "bash, zsh or fish")->one_of({"bash", "zsh", "fish"})->required();
}

}  // namespace whirl::app
