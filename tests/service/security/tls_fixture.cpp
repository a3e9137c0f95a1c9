#include "security/tls_fixture.h"

#include <spdlog/spdlog.h>

#include <filesystem>

namespace helio::test {
namespace {

void replace_file(const std::string& path, const std::string& text) {
  write_file(path + ".new", text);
  std::filesystem::rename(path + ".new", path);
}

}  // namespace

void TlsTest::write_issued(const std::string& name, const Issued& issued) const {
  replace_file(in(name + ".pem"), issued.certificate);
  replace_file(in(name + ".key"), issued.key);
}

void TlsTest::start_tls(const std::function<void(ServerConfig&)>& change) {
  spdlog::set_level(spdlog::level::off);  // refused handshakes are what these tests are about
  if (!std::filesystem::exists(in("daemon.pem"))) write_issued("daemon", authority_.issue("daemon"));
  ServerConfig config;
  config.render_threads = 1;
  config.max_memory = 1ull << 30;
  config.tls_certificate = in("daemon.pem");
  config.tls_key = in("daemon.key");
  if (change) change(config);
  auto server = Server::start(config);
  ASSERT_TRUE(server.ok()) << server.error().to_string();
  server_ = std::move(*server);
}

std::shared_ptr<grpc::Channel> TlsTest::tls_channel(const std::string& ca, const Issued& own) const {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(server_->address(), grpc::SslCredentials({ca, own.key, own.certificate}), arguments);
}

bool TlsTest::answers(const std::shared_ptr<grpc::Channel>& channel) {
  const auto stub = pb::RenderService::NewStub(channel);
  grpc::ClientContext context;
  pb::GetServerInfoResponse response;
  return stub->GetServerInfo(&context, pb::GetServerInfoRequest(), &response).ok();
}

}  // namespace helio::test
