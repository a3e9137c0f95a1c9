// The command and a daemon that speaks TLS: what it needs, and what it says when that is not given.
#include <cstdlib>

#include "cli_test.h"
#include "daemon_process.h"
#include "security/certificates.h"

namespace helio::test {
namespace {

class TlsClient : public CliTest {
 protected:
  std::string in(const std::string& name) const { return folder_ / name; }
  void write_issued(const std::string& name, const Issued& issued) {
    write_file(in(name + ".pem"), issued.certificate);
    write_file(in(name + ".key"), issued.key);
  }
  std::unique_ptr<DaemonProcess> start(const Issued& issued, std::vector<std::string> more = {}) {
    write_issued("daemon", issued);
    write_file(in("ca.pem"), authority_.certificate());
    std::vector<std::string> arguments = {"--tls-certificate", in("daemon.pem"), "--tls-key",
                                          in("daemon.key"),    "--log-level",    "off"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return std::make_unique<DaemonProcess>(arguments);
  }
  ProcessResult info(const DaemonProcess& daemon, std::vector<std::string> more) {
    more.insert(more.begin(), {"info", "--server", daemon.address()});
    return heliograph(more);
  }
  // Exit code 4, and each of the parts in one line.
  void expect_unreachable(const ProcessResult& result, const std::vector<std::string>& parts) {
    EXPECT_EQ(result.exit_code, 4) << result.err;
    expect_one_line(result.err);
    for (const std::string& part : parts)
      EXPECT_NE(result.err.find(part), std::string::npos) << part << ": " << result.err;
  }

  const Authority authority_{"authority of the tests"};
};

TEST_F(TlsClient, NeedsTheAuthority) {
  const auto daemon = start(authority_.issue("daemon"));
  EXPECT_EQ(info(*daemon, {"--tls-ca", in("ca.pem")}).exit_code, 0);
  expect_unreachable(info(*daemon, {}), {"it speaks TLS", "--tls", "--tls-ca FILE"});
  expect_unreachable(info(*daemon, {"--tls"}), {"comes from no authority that this machine trusts", "--tls-ca FILE"});
  write_file(in("wrong.pem"), Authority("wrong").certificate());
  expect_unreachable(info(*daemon, {"--tls-ca", in("wrong.pem")}),
                     {"comes from no authority in '" + in("wrong.pem") + "'", "--tls-ca FILE"});
  // Renders over it.
  const ProcessResult rendered = heliograph({"render", "quad.gltf", "--server", daemon->address(), "--tls-ca",
                                             in("ca.pem"), "--samples", "1", "--size", "8x8", "--output", "quad.exr"});
  EXPECT_EQ(rendered.exit_code, 0) << rendered.err;
  EXPECT_TRUE(exists("quad.exr"));
}

TEST_F(TlsClient, TellsAnExpiredCertificateAndAnotherName) {
  {
    const auto expired = start(authority_.issue("daemon", {.from_days = -3, .to_days = -1}));
    expect_unreachable(info(*expired, {"--tls-ca", in("ca.pem")}), {"has expired"});
  }
  const auto named = start(authority_.issue("daemon", {.names = "DNS:render.example"}));
  expect_unreachable(info(*named, {"--tls-ca", in("ca.pem")}),
                     {"is not for '127.0.0.1' but for 'render.example'", "--tls-name NAME"});
  EXPECT_EQ(info(*named, {"--tls-ca", in("ca.pem"), "--tls-name", "render.example"}).exit_code, 0);
}

TEST_F(TlsClient, ShowsACertificateWhereOneIsAskedFor) {
  const Authority callers("callers");
  write_file(in("callers.pem"), callers.certificate());
  const auto daemon = start(authority_.issue("daemon"), {"--tls-client-ca", in("callers.pem")});
  write_issued("alice", callers.issue("alice"));
  write_issued("mallory", Authority("strangers").issue("mallory"));
  const auto with = [&](const std::string& name) {
    return info(*daemon,
                {"--tls-ca", in("ca.pem"), "--tls-certificate", in(name + ".pem"), "--tls-key", in(name + ".key")});
  };
  const ProcessResult alice = with("alice");
  EXPECT_EQ(alice.exit_code, 0) << alice.err;
  expect_unreachable(info(*daemon, {"--tls-ca", in("ca.pem")}),
                     {"asks for a certificate of its callers", "--tls-certificate FILE", "--tls-key FILE"});
  expect_unreachable(with("mallory"), {"does not accept the certificate in '" + in("mallory.pem") + "'"});
  expect_unreachable(info(*daemon, {}), {"it speaks TLS"});
}

TEST_F(TlsClient, SaysThatADaemonDoesNotSpeakIt) {
  DaemonProcess plain({"--log-level", "off"});
  write_file(in("ca.pem"), authority_.certificate());
  expect_unreachable(info(plain, {"--tls-ca", in("ca.pem")}), {"does not speak TLS"});
  expect_unreachable(heliograph({"info", "--server", "127.0.0.1:1", "--tls"}), {"no server answers at 127.0.0.1:1"});
}

TEST_F(TlsClient, TakesItsFilesFromVariablesToo) {
  const auto daemon = start(authority_.issue("daemon"));
  setenv("HELIOGRAPH_TLS_CA", in("ca.pem").c_str(), 1);
  const ProcessResult encrypted = info(*daemon, {});
  DaemonProcess plain({"--log-level", "off"});
  const ProcessResult plainly = info(plain, {"--no-tls"});
  setenv("HELIOGRAPH_TLS", "perhaps", 1);
  const ProcessResult wrong = info(*daemon, {});
  unsetenv("HELIOGRAPH_TLS");
  unsetenv("HELIOGRAPH_TLS_CA");
  EXPECT_EQ(encrypted.exit_code, 0) << encrypted.err;
  EXPECT_EQ(plainly.exit_code, 0) << plainly.err;
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("HELIOGRAPH_TLS: 'perhaps'; allowed: on, off"), std::string::npos) << wrong.err;
}

TEST_F(TlsClient, NamesEveryFileThatDoesNotFit) {
  write_issued("alice", authority_.issue("alice"));
  write_issued("bob", authority_.issue("bob"));
  const ProcessResult both = heliograph({"info", "--server", "127.0.0.1:1", "--tls-ca", in("missing.pem"),
                                         "--tls-certificate", in("alice.pem"), "--tls-key", in("bob.key")});
  EXPECT_EQ(both.exit_code, 2);
  expect_one_line(both.err);
  EXPECT_NE(both.err.find("--tls-ca: '" + in("missing.pem") + "'"), std::string::npos) << both.err;
  EXPECT_NE(both.err.find("--tls-key: '" + in("bob.key") + "' is not the key"), std::string::npos) << both.err;
  const ProcessResult half = heliograph({"info", "--server", "127.0.0.1:1", "--tls-certificate", in("alice.pem")});
  EXPECT_EQ(half.exit_code, 2);
  EXPECT_NE(half.err.find("--tls-key: is missing"), std::string::npos) << half.err;
  const ProcessResult here = heliograph({"info", "--tls"});
  EXPECT_EQ(here.exit_code, 2);
  EXPECT_NE(here.err.find("--tls: is only valid with --server"), std::string::npos) << here.err;
}

}  // namespace
}  // namespace helio::test
