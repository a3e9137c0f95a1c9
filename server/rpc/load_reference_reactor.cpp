#include "server/rpc/load_reference_reactor.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <utility>

#include "renderer/codec/sha256.h"
#include "server/base/arena_message.h"
#include "server/base/grpc_status.h"
#include "server/base/guarded.h"
#include "server/base/parse_message.h"

namespace helio {
namespace {

constexpr std::size_t kMaxChunk = 1 << 20;

Error out_of_order(const char* message, const char* where) {
  return {ErrorCode::invalid_argument, message, where};
}

}  // namespace

struct LoadReferenceReactor::Upload {
  std::vector<std::uint8_t> bytes;
  std::uint64_t expected = 0;
  std::string sha256;  // hexadecimal
  Reservation memory;
};

LoadReferenceReactor::LoadReferenceReactor(CompareCore& compare, CallerPtr caller, grpc::CallbackServerContext& context,
                                           grpc::ByteBuffer* response)
    : compare_(compare), caller_(std::move(caller)), call_(std::make_shared<Call>(*this, context, *response)) {
  const auto call = call_;
  under_way_ = compare.core.access.begin(caller_, [weak = std::weak_ptr(call)](const grpc::Status& status) {
    if (const auto there = weak.lock()) there->finish(status);
  });
  if (const Status accepting = compare.core.check_accepting(); !accepting.ok()) {
    call->finish(to_grpc_status(accepting));
    return;
  }
  place_ = compare.core.open_calls.add([weak = std::weak_ptr(call), &core = compare.core] {
    if (const auto open = weak.lock()) open->finish(to_grpc_status(core.check_accepting()));
  });
  const double seconds = compare.core.config.request_timeout_s;
  message_due_ = std::make_unique<ReadDeadline>(compare.core.timers, seconds, [call, seconds] {
    call->finish({grpc::StatusCode::DEADLINE_EXCEEDED,
                  fmt::format("the next message of the upload did not come within {} s (request-timeout)", seconds)});
  });
  read();
}

void LoadReferenceReactor::read() {
  message_due_->start();
  StartRead(&request_);
}

void LoadReferenceReactor::OnReadDone(bool ok) {
  const auto call = call_;
  if (!message_due_->stop() || call->over()) return;
  const Status status = guarded([&]() -> Status {
    if (!ok) return submit();
    ArenaMessage<pb::LoadReferenceRequest> request;
    if (const Status parsed = parse_message(request_, *request); !parsed.ok()) return parsed;
    return handle(*request);
  });
  if (!status.ok()) return call->finish(to_grpc_status(status));
  if (!ok) return;
  request_.Clear();
  read();
}

Status LoadReferenceReactor::handle(const pb::LoadReferenceRequest& request) {
  std::vector<std::string> unknown = unknown_fields(request);
  // A request of a kind that only newer daemons know.
  const bool unknown_kind = request.request_case() == pb::LoadReferenceRequest::REQUEST_NOT_SET && !unknown.empty();
  call_->ignore(std::move(unknown));
  if (unknown_kind) return ok_status();
  switch (request.request_case()) {
    case pb::LoadReferenceRequest::kBegin:
      if (upload_) return out_of_order("was sent before; allowed: once, as the first message", "begin");
      return begin(request.begin());
    case pb::LoadReferenceRequest::kData: {
      if (!upload_) return out_of_order("the first message is not begin", "request");
      const std::string& data = request.data();
      const std::uint64_t left = upload_->expected - upload_->bytes.size();
      if (data.empty() || data.size() > kMaxChunk || data.size() > left) {
        return Error{ErrorCode::invalid_argument,
                     fmt::format("{} bytes, {} are left of begin.bytes; allowed: [1, {}]", data.size(), left,
                                 std::min<std::uint64_t>(kMaxChunk, left)),
                     "data"};
      }
      upload_->bytes.insert(upload_->bytes.end(), data.begin(), data.end());
      return ok_status();
    }
    case pb::LoadReferenceRequest::REQUEST_NOT_SET:
      break;
  }
  return out_of_order("is empty; allowed: begin or data", "request");
}

Status LoadReferenceReactor::begin(const pb::LoadReferenceRequest::Begin& begin) {
  Problems problems;
  if (begin.bytes() == 0) problems.add("begin.bytes", "0; allowed: at least 1");
  if (begin.sha256().size() != sizeof(Sha256Digest))
    problems.add("begin.sha256", fmt::format("{} bytes; allowed: {}", begin.sha256().size(), sizeof(Sha256Digest)));
  if (!problems.empty()) return problems.to_error();
  if (begin.bytes() > compare_.references.limit()) {
    return Error{ErrorCode::resource_exhausted,
                 fmt::format("max_reference_memory: the file has {} bytes; allowed: {}", begin.bytes(),
                             compare_.references.limit()),
                 {}};
  }
  auto memory = compare_.core.memory_of(*caller_).reserve_with_room(begin.bytes(), "the upload of a reference",
                                                                    MemoryOwner::uploads);
  if (!memory) return memory.error();
  upload_ = std::make_shared<Upload>();
  upload_->expected = begin.bytes();
  upload_->memory = std::move(*memory);
  const auto* digest = reinterpret_cast<const std::uint8_t*>(begin.sha256().data());
  upload_->sha256 = to_hex({digest, begin.sha256().size()});
  return ok_status();
}

Status LoadReferenceReactor::submit() {
  if (!upload_) return out_of_order("the stream ended before begin", "request");
  if (upload_->bytes.size() != upload_->expected) {
    return Error{ErrorCode::invalid_argument,
                 fmt::format("{} bytes came; allowed: begin.bytes, {}", upload_->bytes.size(), upload_->expected),
                 "data"};
  }
  const bool taken =
      compare_.core.films.submit([call = call_, upload = std::move(upload_), &references = compare_.references] {
        call->finish(guarded([&]() -> Result<pb::LoadReferenceResponse> {
          Sha256 hash;
          hash.update(std::span<const std::uint8_t>(upload->bytes));
          const std::string found = to_hex(hash.finish());
          if (found != upload->sha256)
            return Error{ErrorCode::invalid_argument, "is not that of the data, " + found, "begin.sha256"};
          const auto reference = references.load(upload->bytes, upload->sha256);
          if (!reference) return reference.error();
          pb::LoadReferenceResponse response;
          response.set_reference_id((*reference)->id);
          response.set_width((*reference)->mean.width);
          response.set_height((*reference)->mean.height);
          response.set_has_variance((*reference)->variance.has_value());
          return response;
        }));
      });
  return taken ? ok_status() : Status(compare_.core.too_many_waiting());
}

void LoadReferenceReactor::OnCancel() {
  const auto call = call_;
  call->finish({grpc::StatusCode::CANCELLED, "the caller gave up"});
}

}  // namespace helio
