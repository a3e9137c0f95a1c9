// A channel to a daemon, and how calls are made on it: token, deadline, cancelling, errors. RenderClient and the
// clients of single areas share one.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/support/sync_stream.h>

#include <functional>
#include <memory>
#include <string>

#include "client/call_control.h"
#include "client/grpc_error.h"
#include "client/tls/tls_options.h"
#include "heliograph/v1/render_service.grpc.pb.h"
#include "renderer/base/clock.h"
#include "renderer/base/result.h"

namespace helio {

struct ConnectOptions {
  double timeout_s = 10;  // for the connection, > 0
  bool retry = false;     // true: a refused connection is tried again until the timeout (a daemon that is starting)
  double call_timeout_s = 30;  // of the short calls (all but loads, edits, streams, jobs and comparisons), > 0
  std::string token;           // of the daemon's token file; empty: none
  TlsOptions tls;              // without it everything travels unencrypted, the token, too
  // Told on the thread of a call when the server is older than this client and ignored some of its request's fields.
  std::function<void(const std::string& text)> notice;
};

// Thread safe.
class ServiceLink {
 public:
  using Stub = heliograph::v1::RenderService::StubInterface;

  // `peer` names the other side in messages.
  ServiceLink(std::shared_ptr<grpc::Channel> channel, std::string peer, ConnectOptions options)
      : channel_(std::move(channel)),
        stub_(heliograph::v1::RenderService::NewStub(channel_)),
        peer_(std::move(peer)),
        options_(std::move(options)) {}

  Stub& stub() const { return *stub_; }
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  const std::string& peer() const { return peer_; }
  const ConnectOptions& options() const { return options_; }

  // Waits until the channel is connected, at most so many seconds. False: it is not. Without it nobody has a channel
  // connect again between calls that fail at once.
  bool reach(double seconds) const { return channel_->WaitForConnected(deadline_in(seconds)); }

  void authorize(grpc::ClientContext& context) const;
  // The outcome of a call. The notice about ignored fields is given.
  Status status_of(const grpc::Status& status, const grpc::ClientContext& context) const;

  // With the deadline of short calls.
  template <class Request, class Response>
  Result<Response> call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                        const Request& request, CallControl* control = nullptr) const {
    grpc::ClientContext context;
    authorize(context);
    context.set_deadline(deadline_in(options_.call_timeout_s));
    const CallControl::Scope scope(control, context);
    Response response;
    const Status done = status_of((stub().*method)(&context, request, &response), context);
    if (!done) return done.error();
    return response;
  }
  // `write` sends the messages; its error cancels the call and is answered.
  template <class Request, class Response>
  Result<Response> upload(std::unique_ptr<grpc::ClientWriterInterface<Request>> (Stub::*method)(grpc::ClientContext*,
                                                                                                Response*),
                          const std::function<Status(grpc::ClientWriterInterface<Request>&)>& write,
                          CallControl* control) const {
    grpc::ClientContext context;
    authorize(context);
    const CallControl::Scope scope(control, context);
    Response response;
    const auto call = (stub().*method)(&context, &response);
    const Status written = write(*call);
    if (!written) {
      context.TryCancel();
      call->Finish();
      return written.error();
    }
    call->WritesDone();
    const Status done = status_of(call->Finish(), context);
    if (!done) return done.error();
    return response;
  }
  // Calls take(response) with each message; its error cancels the call and is answered.
  template <class Request, class Response>
  Status read(std::unique_ptr<grpc::ClientReaderInterface<Response>> (Stub::*method)(grpc::ClientContext*,
                                                                                     const Request&),
              const Request& request, const std::function<Status(Response&)>& take, CallControl* control) const {
    grpc::ClientContext context;
    authorize(context);
    const CallControl::Scope scope(control, context);
    const auto call = (stub().*method)(&context, request);
    Response response;
    while (call->Read(&response)) {
      const Status taken = take(response);
      if (taken) continue;
      context.TryCancel();
      call->Finish();
      return taken;
    }
    return status_of(call->Finish(), context);
  }

 private:
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<Stub> stub_;
  std::string peer_;
  ConnectOptions options_;
};

}  // namespace helio
