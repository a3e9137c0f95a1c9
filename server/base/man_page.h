// Man pages made from the tables of options that --help prints.
#pragma once

#include <string>
#include <vector>

// CLI11's header makes every file that includes it slow to compile.
namespace CLI {
class App;
}

namespace helio {

struct ManPage {
  std::string name;  // of the program
  int section = 1;
  std::string summary;  // a clause for the NAME section
  std::string version;
  struct Section {
    std::string title;
    std::string text;  // paragraphs are separated by empty lines
  };
  std::vector<Section> sections;  // between options and exit codes
};

// In roff's man macros: synopsis, options and commands of `app`, each with its help and footer. Hidden options and
// commands are left out.
std::string man_page(const CLI::App& app, const ManPage& page);

}  // namespace helio
