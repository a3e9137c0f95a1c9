#include "server/scenes/scene_bundle.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace helio {
namespace {

std::string shown(const std::string& name) {
  return name.size() <= 128 ? "'" + name + "'" : "'" + name.substr(0, 128) + "...'";
}

bool is_control(unsigned char c) {
  return c < ' ' || c == 127;
}

bool has_control(const std::string& text) {
  return std::any_of(text.begin(), text.end(), is_control);
}

// Up to the first of them.
std::string without_control(const std::string& text) {
  return {text.begin(), std::find_if(text.begin(), text.end(), is_control)};
}

Error invalid(std::string where, std::string message) {
  return {ErrorCode::invalid_argument, std::move(message), std::move(where)};
}

bool has_bad_component(const std::string& name) {
  std::size_t begin = 0;
  while (begin <= name.size()) {
    const std::size_t end = std::min(name.find('/', begin), name.size());
    const std::string component = name.substr(begin, end - begin);
    if (component.empty() || component == "." || component == "..") return true;
    begin = end + 1;
  }
  return false;
}

}  // namespace

void check_bundle_name(const std::string& name, const std::string& where, Problems& problems) {
  const bool drive = name.size() >= 2 && name[1] == ':';
  if (name.empty() || name.size() > BundleReceiver::kMaxName || has_bad_component(name) || drive ||
      name.find('\\') != std::string::npos || has_control(name)) {
    problems.add(where, fmt::format("{} ({} bytes); allowed: a relative path of 1 to {} bytes, '/'-separated, without "
                                    "\".\", \"..\", backslashes and control characters",
                                    shown(without_control(name)), name.size(), BundleReceiver::kMaxName));
  }
}

void BundleReceiver::check(const heliograph::v1::LoadSceneRequest::Begin& message, Problems& problems) const {
  check_bundle_name(message.main_file(), "begin.main_file", problems);
  if (message.total_bytes() == 0) {
    problems.add("begin.total_bytes", fmt::format("0; allowed: [1, {}]", max_scene_bytes_));
  }
}

Status BundleReceiver::begin(const heliograph::v1::LoadSceneRequest::Begin& message) {
  if (message.total_bytes() > max_scene_bytes_) {
    return Error{ErrorCode::resource_exhausted,
                 fmt::format("{}; allowed: max_scene_bytes = {}", message.total_bytes(), max_scene_bytes_),
                 "begin.total_bytes"};
  }
  auto memory = memory_.reserve_with_room(message.total_bytes(), "the uploaded bundle", MemoryOwner::uploads);
  if (!memory) return memory.error();
  bundle_.memory = std::move(*memory);
  bundle_.main_file = message.main_file();
  total_bytes_ = message.total_bytes();
  return ok_status();
}

Status BundleReceiver::begin_file(const heliograph::v1::LoadSceneRequest::BeginFile& message) {
  if (const Status done = finish_file(); !done.ok()) return done;
  Problems problems;
  check_bundle_name(message.name(), "begin_file.name", problems);
  if (bundle_.digests.contains(message.name())) {
    problems.add("begin_file.name", shown(message.name()) + " was sent before; allowed: unique names");
  }
  if (bundle_.files.size() >= kMaxFiles) {
    problems.add("begin_file", fmt::format("file number {}; allowed: at most {} files", kMaxFiles + 1, kMaxFiles));
  }
  if (message.bytes() > total_bytes_ - announced_bytes_) {
    problems.add("begin_file.bytes", fmt::format("{}; allowed: [0, {}], what begin.total_bytes = {} leaves",
                                                 message.bytes(), total_bytes_ - announced_bytes_, total_bytes_));
  }
  if (message.sha256().size() != 32) {
    problems.add("begin_file.sha256", fmt::format("{} bytes; allowed: 32", message.sha256().size()));
  }
  if (!problems.empty()) return problems.to_error();
  announced_bytes_ += message.bytes();
  file_open_ = true;
  file_bytes_ = message.bytes();
  file_sha256_ = message.sha256();
  hash_.emplace();
  bundle_.files.push_back({message.name(), {}});
  return ok_status();
}

Status BundleReceiver::data(const std::string& chunk) {
  if (!file_open_) return invalid("data", "before any begin_file; allowed: after the begin_file that it belongs to");
  if (chunk.size() > kMaxChunk) {
    return invalid("data", fmt::format("{} bytes; allowed: at most {} a message", chunk.size(), kMaxChunk));
  }
  NamedFile& file = bundle_.files.back();
  if (chunk.size() > file_bytes_ - file.bytes.size()) {
    return invalid("data", fmt::format("{} bytes of {} where {} were announced", file.bytes.size() + chunk.size(),
                                       shown(file.path), file_bytes_));
  }
  // Grows with what arrives, so that an announcement alone costs nothing.
  file.bytes.reserve(std::min<std::uint64_t>(file_bytes_, std::max(2 * file.bytes.capacity(), 4 * kMaxChunk)));
  file.bytes.insert(file.bytes.end(), chunk.begin(), chunk.end());
  hash_->update(chunk);
  return ok_status();
}

Status BundleReceiver::finish_file() {
  if (!file_open_) return ok_status();
  file_open_ = false;
  const NamedFile& file = bundle_.files.back();
  if (file.bytes.size() != file_bytes_) {
    return invalid("data",
                   fmt::format("{} ends after {} bytes of {}", shown(file.path), file.bytes.size(), file_bytes_));
  }
  const Sha256Digest digest = hash_->finish();
  if (!std::equal(digest.begin(), digest.end(), reinterpret_cast<const std::uint8_t*>(file_sha256_.data()))) {
    return invalid("begin_file.sha256",
                   fmt::format("{}: the bytes received have {}, {} was announced", shown(file.path), to_hex(digest),
                               to_hex({reinterpret_cast<const std::uint8_t*>(file_sha256_.data()), 32})));
  }
  bundle_.digests.emplace(file.path, digest);
  return ok_status();
}

Result<SceneBundle> BundleReceiver::finish() {
  if (const Status done = finish_file(); !done.ok()) return done.error();
  if (announced_bytes_ != total_bytes_) {
    return invalid("begin.total_bytes", fmt::format("{} were announced, {} arrived", total_bytes_, announced_bytes_));
  }
  if (!bundle_.digests.contains(bundle_.main_file)) {
    return invalid("begin.main_file", shown(bundle_.main_file) + " is not among the files of the bundle");
  }
  return std::move(bundle_);
}

}  // namespace helio
