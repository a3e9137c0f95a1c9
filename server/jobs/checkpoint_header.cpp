#include "server/jobs/checkpoint_header.h"

#include "server/jobs/checkpoint_header.pb.h"
#include "server/state/sealed_message.h"

namespace helio {
namespace {

constexpr std::uint32_t kVersion = 2;

}  // namespace

std::string CheckpointHeader::write() const {
  heliograph::kept::CheckpointHeader message;
  message.set_view(view);
  message.set_build(build);
  message.set_same_bits(same_bits);
  if (frame_end) message.set_frame_end(*frame_end);
  message.set_progress(progress);
  message.set_time_s(time_s);
  const std::vector<std::uint8_t> bytes = seal(message, kVersion);
  return {bytes.begin(), bytes.end()};
}

Result<CheckpointHeader> CheckpointHeader::read(const std::string& bytes) {
  heliograph::kept::CheckpointHeader message;
  if (const Status read = unseal(bytes, kVersion, message); !read.ok())
    return Error{read.error().code, "its header " + read.error().message, {}};
  CheckpointHeader header;
  header.view = message.view();
  header.build = message.build();
  header.same_bits = message.same_bits();
  if (message.has_frame_end()) header.frame_end = message.frame_end();
  header.progress = message.progress();
  header.time_s = message.time_s();
  return header;
}

}  // namespace helio
