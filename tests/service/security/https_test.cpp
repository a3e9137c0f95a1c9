// The page and its socket by https and wss.
#include <spdlog/spdlog.h>

#include "heliograph/v1/web.pb.h"
#include "security/tls_fixture.h"
#include "server/web/web_server.h"
#include "web/web_peer.h"

namespace helio::test {
namespace {

class Https : public TlsTest {
 protected:
  void start_page(const std::function<void(ServerConfig&)>& change = {}) {
    start_tls([&](ServerConfig& config) {
      config.http = "127.0.0.1:0";
      if (change) change(config);
    });
  }
  const std::string& http() const { return server_->http_address(); }
  WebTrust trust(const Issued& own = {}) const { return {authority_.certificate(), own.certificate, own.key}; }
  int status(const WebTrust& trust) const { return WebPeer(http(), trust).get("/").status; }
};

TEST_F(Https, ServesThePageAndItsSocket) {
  start_page();
  WebPeer page(http(), trust());
  const HttpAnswer first = page.get("/");
  EXPECT_EQ(first.status, 200);
  EXPECT_NE(first.body.find("<!doctype html>"), std::string::npos);
  EXPECT_EQ(page.get("/app.js").status, 200) << "on the same connection";
  EXPECT_EQ(page.get("/healthz").body, "ok\n");

  WebPeer socket(http(), trust());
  ASSERT_EQ(socket.upgrade({{"Origin", "https://127.0.0.1"}}).status, 101);
  pb::WebRequest hello;
  hello.mutable_hello()->set_envelope(1);
  socket.send_message(hello.SerializeAsString());
  const auto welcome = socket.read_frame();
  ASSERT_TRUE(welcome);
  EXPECT_EQ(welcome->opcode, 2);
  pb::WebRequest request;
  request.set_id(1);
  request.mutable_get_server_info();
  socket.send_message(request.SerializeAsString());
  const auto frame = socket.read_frame();
  ASSERT_TRUE(frame);
  pb::WebResponse response;
  ASSERT_TRUE(response.ParseFromString(frame->payload));
  EXPECT_EQ(response.get_server_info().http_address(), http());
  EXPECT_TRUE(response.get_server_info().http_tls());

  // A message as large as there may be, in many records of TLS.
  request.Clear();
  request.set_id(2);
  request.mutable_load_scene()->set_data(std::string((4 << 20) - 100, 'x'));
  socket.send_message(request.SerializeAsString());
  std::optional<WebFrame> answer;
  while ((answer = socket.read_frame()) && answer->opcode == 2) {
    ASSERT_TRUE(response.ParseFromString(answer->payload));
    if (response.id() == 2 && response.has_status()) break;
  }
  EXPECT_EQ(response.status().code(), int(grpc::StatusCode::INVALID_ARGUMENT)) << "before begin";
}

TEST_F(Https, TellsABrowserThatSpeaksPlainHttp) {
  start_page();
  WebPeer plain(http());
  const HttpAnswer answer = plain.get("/");
  EXPECT_EQ(answer.status, 400);
  EXPECT_TRUE(plain.ended());
  WebPeer rubbish(http());
  rubbish.send("\x01\x02\x03 rubbish\r\n\r\n");
  EXPECT_TRUE(rubbish.ended());
  EXPECT_EQ(status(trust()), 200) << "others are served";
  EXPECT_EQ(status({Authority("another").certificate(), "", ""}), 0);
}

TEST_F(Https, TakesUpReplacedFiles) {
  start_page();
  const Authority next("next");
  write_issued("daemon", next.issue("daemon"));
  server_->reload();
  EXPECT_EQ(status(trust()), 0);
  EXPECT_EQ(status({next.certificate(), "", ""}), 200);
  write_file(in("daemon.key"), "rubbish");
  server_->reload();
  EXPECT_EQ(status({next.certificate(), "", ""}), 200);
}

TEST_F(Https, AsksForTheCertificatesThatGrpcAsksFor) {
  const Authority callers("callers"), strangers("strangers");
  write_file(in("callers.pem"), callers.certificate());
  start_page([&](ServerConfig& config) {
    config.http = "0.0.0.0:0";  // with certificates of callers no tokens are asked for
    config.tls_client_ca = in("callers.pem");
  });
  EXPECT_EQ(status(trust()), 0);
  EXPECT_EQ(status(trust(strangers.issue("mallory"))), 0);
  EXPECT_EQ(status(trust(callers.issue("alice"))), 200);
}

TEST_F(Https, SilentPeersLoseTheirConnection) {
  spdlog::set_level(spdlog::level::off);
  start();
  write_issued("daemon", authority_.issue("daemon"));
  WebServer::Options options;
  options.listen = "127.0.0.1:0";
  options.max_connections = 2;
  options.patience_s = 0.3;
  options.certificates = TlsCertificates::open({in("daemon.pem"), in("daemon.key"), ""}).value();
  auto web = WebServer::listen(options);
  ASSERT_TRUE(web.ok());
  (*web)->serve({});
  (*web)->open(server_->in_process_channel());
  WebPeer silent((*web)->address()), half((*web)->address());
  half.send(std::string("\x16\x03\x01\x02\x00", 5));  // the head of a record that never comes
  EXPECT_TRUE(silent.ended());
  EXPECT_TRUE(half.ended());
  EXPECT_TRUE(eventually([&] { return WebPeer((*web)->address(), trust()).get("/healthz").status == 200; }));
}

}  // namespace
}  // namespace helio::test
