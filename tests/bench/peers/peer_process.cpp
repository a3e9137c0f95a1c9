#include "tests/bench/peers/peer_process.h"

#include <nlohmann/json.hpp>

namespace helio::bench {

using nlohmann::json;

Result<json> PeerProcess::ask(const json& request) {
  const Status sent = process_->write_line(request.dump());
  if (!sent) return sent.error();
  json answer;
  while (!answer.is_object()) {
    const auto line = process_->read_line();
    if (!line) return line.error();
    answer = json::parse(*line, nullptr, false);
  }
  if (answer.contains("error")) {
    return Error{ErrorCode::internal, request.dump() + ": " + answer["error"].get<std::string>(), name_};
  }
  return answer;
}

}  // namespace helio::bench
