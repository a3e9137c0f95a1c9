#include "server/base/man_page.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <sstream>

namespace helio {
namespace {

// A line of text as roff prints it, whatever it holds.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else if (c == '\n') {
      out += ' ';
    } else if ((c == '.' || c == '\'') && out.empty()) {
      out += "\\&";
      out += c;
    } else if (c == '`') {
      out += "\\(ga";
    } else if (c == '^') {
      out += "\\(ha";
    } else if (c == '~') {
      out += "\\(ti";
    } else {
      out += c;
    }
  }
  return out;
}

// As the argument of a macro, whose quotes are doubled.
std::string macro_argument(const std::string& text) {
  std::string out = "\"";
  for (const char c : escaped(text)) out += c == '"' ? std::string("\\(dq") : std::string(1, c);
  return out + "\"";
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::toupper(c)); });
  return text;
}

// Paragraphs; lines that start with a space keep their breaks.
void write_text(std::ostream& out, const std::string& text) {
  std::istringstream lines(text);
  bool paragraph_begun = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.find_first_not_of(' ') == std::string::npos) {
      if (paragraph_begun) out << ".PP\n";
      paragraph_begun = false;
      continue;
    }
    if (line[0] == ' ' && paragraph_begun) out << ".br\n";
    out << escaped(line) << '\n';
    paragraph_begun = true;
  }
}

bool is_visible(const CLI::Option& option) {
  return !option.get_group().empty();
}

std::vector<const CLI::App*> visible_commands(const CLI::App& app) {
  std::vector<const CLI::App*> commands;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (!command->get_group().empty()) commands.push_back(command);
  }
  return commands;
}

std::string path_of(const CLI::App& app) {
  return (app.get_parent() ? path_of(*app.get_parent()) + " " : "") + app.get_name();
}

void write_synopsis(std::ostream& out, const CLI::App& app) {
  out << ".B " << escaped(path_of(app)) << "\n";
  out << "[OPTIONS]\n";
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_positional() && is_visible(*option)) out << ".RI [ " << escaped(option->get_name(true)) << " ]\n";
  }
  if (!visible_commands(app).empty()) out << ".I COMMAND\n";
}

void write_options(std::ostream& out, const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    if (!is_visible(*option)) continue;
    std::string names = option->get_name(false, true), separated;
    for (const char c : names) separated += c == ',' ? std::string(", ") : std::string(1, c);
    out << ".TP\n.B " << macro_argument(separated);
    const std::string value = option->get_positional() ? "" : option->get_type_name();
    if (!value.empty() && option->get_type_size() != 0) out << " \\fI" << escaped(value) << "\\fP";
    out << "\n" << escaped(option->get_description()) << "\n";
    if (!option->get_envname().empty()) out << ".br\nEnvironment: " << escaped(option->get_envname()) << "\n";
  }
}

// `exit_codes`: the program's footer, which ends those of its commands and is said once.
void write_command(std::ostream& out, const CLI::App& command, const std::string& exit_codes) {
  out << ".SS " << macro_argument(path_of(command)) << "\n";
  write_text(out, command.get_description());
  out << ".PP\n";
  write_synopsis(out, command);
  write_options(out, command);
  std::string footer = command.get_footer();
  if (footer.ends_with(exit_codes)) footer.resize(footer.size() - exit_codes.size());
  if (!footer.empty()) {
    out << ".PP\n";
    write_text(out, footer);
  }
  for (const CLI::App* inner : visible_commands(command)) write_command(out, *inner, exit_codes);
}

}  // namespace

std::string man_page(const CLI::App& app, const ManPage& page) {
  std::ostringstream out;
  out << ".\\\" Made from the option tables by " << page.name << " --man.\n";
  out << ".TH " << macro_argument(upper(page.name)) << " " << page.section << " \"\" "
      << macro_argument(page.name + " " + page.version) << " "
      << macro_argument(page.section == 8 ? "System Administration" : "User Commands") << "\n";
  out << ".SH NAME\n" << escaped(page.name) << " \\- " << escaped(page.summary) << "\n";
  out << ".SH SYNOPSIS\n";
  write_synopsis(out, app);
  out << ".SH DESCRIPTION\n";
  write_text(out, app.get_description());
  out << ".SH OPTIONS\n";
  write_options(out, app);
  if (const auto commands = visible_commands(app); !commands.empty()) {
    out << ".SH COMMANDS\n";
    for (const CLI::App* command : commands) write_command(out, *command, app.get_footer());
  }
  for (const ManPage::Section& section : page.sections) {
    out << ".SH " << macro_argument(section.title) << "\n";
    write_text(out, section.text);
  }
  if (!app.get_footer().empty()) {
    out << ".SH EXIT STATUS\n";
    write_text(out, app.get_footer());
  }
  return out.str();
}

}  // namespace helio
