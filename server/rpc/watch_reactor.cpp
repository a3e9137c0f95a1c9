#include "server/rpc/watch_reactor.h"

#include <utility>

#include "server/base/grpc_status.h"
#include "server/base/guarded.h"
#include "server/base/parse_message.h"
#include "server/rpc/call_rights.h"
#include "server/rpc/ended_by_reload.h"
#include "server/stream/convert.h"
#include "server/stream/stream_messages.h"

namespace helio {

WatchReactor::WatchReactor(ServiceCore& core, CallerPtr caller, const grpc::ByteBuffer& request)
    : caller_(std::move(caller)) {
  stream_ = std::make_shared<OutboundStream>(
      static_cast<OutboundStream::Call&>(*this),
      [this](Outbound message) { return to_stream_response(std::move(message), session_id_); }, core.timers,
      &core.counters.streams);
  under_way_ = core.access.begin(caller_, end_of(stream_));
  if (stream_->finished()) return;
  const Status started = guarded([&] { return start(request, core); });
  if (!started.ok()) stream_->finish(to_grpc_status(started));
}

Status WatchReactor::start(grpc::ByteBuffer bytes, ServiceCore& core) {
  if (const Status accepting = core.check_accepting(); !accepting.ok()) return accepting;
  pb::WatchFramesRequest request;
  if (const Status parsed = parse_message(bytes, request); !parsed.ok()) return parsed;
  Problems problems;
  check_id(request.session_id(), "session_id", problems);
  const TileFormat format = read_tile_format(request.format(), "format", problems, core.oidn != nullptr);
  if (!problems.empty()) return problems.to_error();
  auto found = core.sessions.find(request.session_id(), "session_id");
  if (!found) return found.error();
  session_id_ = request.session_id();
  session_ = *found;
  const bool own = check_owner(*caller_, session_->owner(), "").ok() && caller_->role >= Role::render;
  const Status attached = session_->attach(stream_, format, own ? Session::TakeOver::yes : Session::TakeOver::no);
  const auto ignored = unknown_fields(request);
  if (attached && !ignored.empty()) stream_->push(ignored_fields_notice(ignored));
  // A drain has told the session before, or finds the stream there.
  return attached ? core.check_accepting() : attached;
}

void WatchReactor::OnCancel() {
  // A client that reads nothing may keep the call from being done for long.
  if (const auto session = std::exchange(session_, nullptr)) session->detach(stream_.get());
  stream_->finish({grpc::StatusCode::CANCELLED, "the caller gave up"});
}

void WatchReactor::OnDone() {
  if (session_) session_->detach(stream_.get());
  delete this;
}

}  // namespace helio
