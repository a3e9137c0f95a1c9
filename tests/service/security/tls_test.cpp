// TLS of gRPC: who gets a connection, which files are taken, and what happens when they are replaced.
#include <netdb.h>
#include <signal.h>

#include <filesystem>

#include "daemon_process.h"
#include "security/tls_fixture.h"
#include "server/web/tls_certificates.h"

namespace helio::test {
namespace {

using Tls = TlsTest;

TEST_F(Tls, IsSpokenWithWhoeverTrustsTheAuthority) {
  start_tls();
  EXPECT_TRUE(server_->tls());
  EXPECT_TRUE(answers(tls_channel(authority_.certificate())));
  EXPECT_FALSE(answers(tls_channel(Authority("another").certificate())));
  EXPECT_FALSE(answers(new_channel())) << "without TLS";
}

TEST_F(Tls, ExpiredAndForeignCertificatesAreRefusedByClients) {
  write_issued("daemon", authority_.issue("daemon", {.from_days = -3, .to_days = -1}));
  start_tls();
  EXPECT_FALSE(answers(tls_channel(authority_.certificate())));
  write_issued("daemon", authority_.issue("daemon", {.names = "DNS:elsewhere.example"}));
  server_->reload();
  EXPECT_FALSE(answers(tls_channel(authority_.certificate())));
  write_issued("daemon", authority_.issue("daemon"));
  server_->reload();
  EXPECT_TRUE(answers(tls_channel(authority_.certificate())));
}

TEST_F(Tls, CallersShowACertificateWhereTheyAreAskedForOne) {
  const Authority callers("authority of callers"), strangers("authority of callers");
  write_file(in("callers.pem"), callers.certificate());
  start_tls([&](ServerConfig& config) { config.tls_client_ca = in("callers.pem"); });
  const std::string ca = authority_.certificate();
  EXPECT_TRUE(answers(tls_channel(ca, callers.issue("alice"))));
  EXPECT_FALSE(answers(tls_channel(ca))) << "none";
  EXPECT_FALSE(answers(tls_channel(ca, strangers.issue("alice")))) << "another authority of the same name";
  EXPECT_FALSE(answers(tls_channel(ca, callers.issue("alice", {.from_days = -3, .to_days = -1})))) << "expired";
}

TEST_F(Tls, ReplacedFilesTakeEffectWithoutARestart) {
  start_tls();
  const auto open = tls_channel(authority_.certificate());
  ASSERT_TRUE(answers(open));
  const Authority next("next authority");
  const Issued issued = next.issue("daemon");

  // Half of the way: the new certificate and the old key do not fit together, and what was before goes on.
  write_file(in("daemon.pem"), issued.certificate);
  server_->reload();
  EXPECT_TRUE(answers(tls_channel(authority_.certificate())));
  EXPECT_FALSE(answers(tls_channel(next.certificate())));
  write_file(in("daemon.pem"), "rubbish");
  server_->reload();
  EXPECT_TRUE(answers(tls_channel(authority_.certificate())));

  // By itself, without a word to the daemon.
  write_issued("daemon", issued);
  EXPECT_TRUE(eventually([&] { return answers(tls_channel(next.certificate())); }));
  EXPECT_FALSE(answers(tls_channel(authority_.certificate())));
  EXPECT_TRUE(answers(open)) << "a connection that was there stays";
}

TEST_F(Tls, AReplacedAuthorityOfCallersTakesEffect) {
  const Authority first("first"), second("second");
  write_file(in("callers.pem"), first.certificate());
  start_tls([&](ServerConfig& config) { config.tls_client_ca = in("callers.pem"); });
  const std::string ca = authority_.certificate();
  EXPECT_TRUE(answers(tls_channel(ca, first.issue("alice"))));
  write_file(in("callers.pem"), second.certificate());
  server_->reload();
  EXPECT_FALSE(answers(tls_channel(ca, first.issue("alice"))));
  EXPECT_TRUE(answers(tls_channel(ca, second.issue("alice"))));
}

TEST_F(Tls, FilesThatDoNotFitAreNamed) {
  const Issued good = authority_.issue("daemon"), other = authority_.issue("other");
  write_issued("good", good);
  write_issued("other", other);
  write_file(in("text"), "no PEM\n");
  write_file(in("locked.key"), with_passphrase(good.key));
  // The second certificate of a chain is cut off in the middle.
  write_file(in("cut.pem"),
             good.certificate + authority_.certificate().substr(0, 200) + "\n-----END CERTIFICATE-----\n");
  struct Case {
    TlsFiles files;
    std::vector<std::string> parts;
  };
  const Case cases[] = {
      {{in("good.pem"), "", ""}, {"tls-key", "is missing"}},
      {{"", in("good.key"), ""}, {"tls-certificate", "is missing"}},
      {{in("missing.pem"), in("missing.key"), ""},
       {"tls-certificate: '" + in("missing.pem"), "tls-key: '" + in("missing.key")}},
      {{in("text"), in("text"), in("text")},
       {"tls-certificate: '" + in("text") + "' holds no certificate",
        "tls-key: '" + in("text") + "' holds no private key",
        "tls-client-ca: '" + in("text") + "' holds no certificate"}},
      {{in("cut.pem"), in("good.key"), ""}, {"certificate 2 in it is broken"}},
      {{in("good.pem"), in("other.key"), ""}, {"'" + in("other.key") + "' is not the key of the first certificate"}},
      {{in("good.pem"), in("locked.key"), ""}, {"wants a passphrase"}},
      {{in("good.pem"), folder_.path(), ""}, {"tls-key: '" + folder_.path() + "'", "regular file"}},
  };
  for (const Case& c : cases) {
    const auto read = read_tls_files(c.files);
    ASSERT_FALSE(read.ok()) << c.parts.front();
    EXPECT_EQ(read.error().code, ErrorCode::invalid_argument);
    for (const std::string& part : c.parts) {
      EXPECT_NE(read.error().message.find(part), std::string::npos) << part << " in: " << read.error().message;
    }
    EXPECT_EQ(read.error().message.find("PRIVATE"), std::string::npos) << "shows a key";
  }
  EXPECT_TRUE(read_tls_files({in("good.pem"), in("good.key"), in("good.pem")}).ok());
  write_issued("old", authority_.issue("old", {.from_days = -3, .to_days = -1}));
  write_issued("young", authority_.issue("young", {.from_days = 1}));
  EXPECT_NE(read_tls_files({in("old.pem"), in("old.key"), ""})->notice.find("has expired"), std::string::npos);
  EXPECT_NE(read_tls_files({in("young.pem"), in("young.key"), ""})->notice.find("not valid yet"), std::string::npos);
  EXPECT_EQ(read_tls_files({in("good.pem"), in("good.key"), ""})->notice, "");
}

TEST_F(Tls, AddressesThatOthersReachWantIt) {
  const auto started = [&](const std::function<void(ServerConfig&)>& change) {
    ServerConfig config;
    config.render_threads = 1;
    change(config);
    auto server = Server::start(config);
    if (server) return std::string();
    EXPECT_EQ(server.error().code, ErrorCode::invalid_argument);
    return server.error().to_string();
  };
  const std::string refused = started([](ServerConfig& config) { config.listen = "0.0.0.0:0"; });
  for (const char* part : {"listen: '0.0.0.0:0'", "--tls-certificate", "--insecure", "ssh -L"})
    EXPECT_NE(refused.find(part), std::string::npos) << refused;
  write_file(in("tokens"), "0123456789abcdef\n");
  const std::string page = started([&](ServerConfig& config) {
    config.http = "[::]:0";
    config.token_file = in("tokens");
  });
  EXPECT_NE(page.find("http: '[::]:0'"), std::string::npos) << page;
  addrinfo* found = nullptr;
  if (getaddrinfo("localhost", nullptr, nullptr, &found) == 0) {  // a minimal system has no name for it
    freeaddrinfo(found);
    EXPECT_EQ(started([](ServerConfig& config) { config.listen = "localhost:0"; }), "");
  }
  EXPECT_EQ(started([](ServerConfig& config) {
              config.listen = "0.0.0.0:0";
              config.insecure = true;
            }),
            "");
  write_issued("daemon", authority_.issue("daemon"));
  EXPECT_EQ(started([&](ServerConfig& config) {
              config.listen = "0.0.0.0:0";
              config.tls_certificate = in("daemon.pem");
              config.tls_key = in("daemon.key");
            }),
            "");

  const ProcessResult program = run_program(HELIO_DAEMON, {"--listen", "0.0.0.0:0", "--state", "none"}, folder_.path());
  EXPECT_EQ(program.exit_code, 2);
  EXPECT_NE(program.err.find("--insecure"), std::string::npos) << program.err;
}

TEST_F(Tls, TheProgramSaysSoAndReadsItsFilesAgainOnSighup) {
  write_issued("daemon", authority_.issue("daemon"));
  const std::vector<std::string> options = {"--listen",          "127.0.0.1:0",    "--state",   "none",
                                            "--tls-certificate", in("daemon.pem"), "--tls-key", in("daemon.key")};
  std::vector<std::string> json = options;
  json.push_back("--json");
  Process daemon(HELIO_DAEMON, json, folder_.path());
  ASSERT_TRUE(daemon.wait_for_output("}")) << daemon.errors();
  EXPECT_NE(daemon.output().find("\"tls\": true"), std::string::npos) << daemon.output();
  write_file(in("daemon.key"), "rubbish");
  daemon.send_signal(SIGHUP);
  EXPECT_TRUE(daemon.wait_for_errors("the files of TLS are left as they were: tls-key: '" + in("daemon.key") + "'"));
  write_issued("daemon", authority_.issue("daemon"));
  daemon.send_signal(SIGHUP);
  EXPECT_TRUE(daemon.wait_for_errors("were read again"));
  daemon.send_signal(SIGTERM);
  EXPECT_EQ(daemon.wait().exit_code, 0);

}

}  // namespace
}  // namespace helio::test
