// A terminal that shows one changing page: redrawn in place, left as it was at the end.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace helio::cli {

struct TerminalSize {
  int rows = 24, columns = 80;
};
// The size of the terminal at stdout, or the defaults above where it cannot be told.
TerminalSize terminal_size();

// At most one at a time, on a terminal as stdout. Not thread safe, but for wake().
class LiveScreen {
 public:
  LiveScreen();
  ~LiveScreen();
  LiveScreen(const LiveScreen&) = delete;
  LiveScreen& operator=(const LiveScreen&) = delete;

  // Lines beyond the terminal's rows are not shown. Each must fit the terminal's columns.
  void draw(const std::vector<std::string>& lines);
  // Waits for so many seconds, less if wake() is called; returns early with true when q was typed.
  bool quits_within(double seconds);
  void wake();  // from any thread

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace helio::cli
