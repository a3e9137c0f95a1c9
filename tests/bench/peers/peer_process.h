// Another renderer that runs a script of ours in a process of its own, and is asked in turns with our runs.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tests/bench/peers/child_process.h"

namespace helio::bench {

class PeerProcess {
 public:
  PeerProcess(std::string name, std::unique_ptr<ChildProcess> process)
      : name_(std::move(name)), process_(std::move(process)) {}

  // Sends one line of JSON and reads lines until one holds an object; what else the program prints is skipped. An
  // answer with "error" is an error that names the request.
  Result<nlohmann::json> ask(const nlohmann::json& request);

 private:
  std::string name_;
  std::unique_ptr<ChildProcess> process_;
};

}  // namespace helio::bench
