// The small parts of the page's server: envelope, table of messages, tokens.
#include <nlohmann/json.hpp>

#include "heliograph/v1/web.pb.h"
#include "process.h"
#include "server/base/access_tokens.h"
#include "server/web/envelope.h"
#include "server/web/protocol_table.h"
#include "server/web/send_rate.h"
#include "service_fixture.h"

namespace helio::test {
namespace {

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// Writes of so many bytes, with pauses between; the rate that was told last.
std::optional<double> send(int writes, std::size_t bytes, double write_s, double pause_s) {
  SendRate rate;
  std::optional<double> told;
  double now_s = 5;
  const auto at = [](double s) {
    return SendRate::Time(std::chrono::duration_cast<SendRate::Time::duration>(std::chrono::duration<double>(s)));
  };
  for (int i = 0; i < writes; ++i) {
    rate.write_begun(at(now_s));
    now_s += write_s;
    if (const auto now = rate.write_ended(bytes, at(now_s))) told = now;
    now_s += pause_s;
  }
  return told;
}

TEST(SendRate, IsToldWhereTheConnectionHoldsWritesUp) {
  const auto rate = send(8, 100'000, 0.1, 0.001);  // a megabyte a second
  ASSERT_TRUE(rate);
  EXPECT_NEAR(*rate, 1e6, 1);
  EXPECT_FALSE(send(4, 100'000, 0.1, 0.001)) << "less than half a second";
  EXPECT_FALSE(send(1000, 100'000, 0.0001, 0.005)) << "writes wait for the renderer";
  EXPECT_FALSE(send(1000, 100'000, 0.0001, 0.2)) << "each write stands alone";
  EXPECT_TRUE(send(1, 3'000'000, 3, 0)) << "one that is long is enough";
  const auto zero = send(2, 0, 1, 0.01);
  ASSERT_TRUE(zero);
  EXPECT_EQ(*zero, 0);
}

TEST(SendRate, KnowsAFastConnection) {
  SendRate rate;
  SendRate::Time now;
  const auto write = [&](int times, std::chrono::milliseconds each) {
    for (int i = 0; i < times; ++i) {
      rate.write_begun(now);
      now += each;
      static_cast<void>(rate.write_ended(400'000, now));
      now += std::chrono::milliseconds(200);  // waiting for the renderer says nothing
    }
    return rate.fast();
  };
  EXPECT_FALSE(write(4, std::chrono::milliseconds(1))) << "too little to tell";
  EXPECT_TRUE(write(1, std::chrono::milliseconds(1)));
  EXPECT_FALSE(write(5, std::chrono::milliseconds(40))) << "10 MB/s";
}

TEST(Envelope, GivesTheContentAsItIs) {
  pb::WebRequest request;
  request.set_id(kMaxCallId);
  request.mutable_stream_frames()->mutable_credit()->set_tiles(7);
  const std::string message = request.SerializeAsString();
  const auto envelope = read_envelope(bytes_of(message));
  ASSERT_TRUE(envelope.ok());
  EXPECT_EQ(envelope->id, kMaxCallId);
  EXPECT_EQ(envelope->field, pb::WebRequest::kStreamFramesFieldNumber);
  pb::StreamRequest content;
  ASSERT_TRUE(content.ParseFromArray(envelope->content.data(), int(envelope->content.size())));
  EXPECT_EQ(content.credit().tiles(), 7u);
}

TEST(Envelope, ReadsWhatProtobufReadsAndRefusesWhatItRefuses) {
  pb::WebRequest request;
  request.set_id(300);
  request.mutable_load_scene()->set_data(std::string(200, 'x'));
  std::string whole = request.SerializeAsString();
  whole += std::string("\x99\x06\1\2\3\4\5\6\7\x8", 10);  // field 99, fixed64
  whole += std::string("\x9d\x06\1\2\3\4", 6);            // field 99, fixed32
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    const std::string cut = whole.substr(0, size);
    pb::WebRequest parsed;
    const auto envelope = read_envelope(bytes_of(cut));
    // Protobuf looks into the content, too, which may be cut only with the envelope.
    EXPECT_EQ(envelope.ok(), parsed.ParseFromString(cut)) << size;
    if (envelope.ok()) {
      EXPECT_EQ(envelope->id, parsed.id());
    }
  }
  EXPECT_FALSE(read_envelope(bytes_of("\x0b")).ok());  // a group
  request.set_id(kMaxCallId + 1);
  EXPECT_FALSE(read_envelope(bytes_of(request.SerializeAsString())).ok());
}

TEST(Envelope, HeadsAResponse) {
  pb::StreamResponse content;
  content.mutable_notice()->set_text(std::string(300, 'n'));
  const std::string inner = content.SerializeAsString();
  const std::string whole = envelope_head(70000, pb::WebResponse::kStreamFramesFieldNumber, inner.size()) + inner;
  pb::WebResponse response;
  ASSERT_TRUE(response.ParseFromString(whole));
  EXPECT_EQ(response.id(), 70000u);
  EXPECT_EQ(response.stream_frames().notice().text(), content.notice().text());
  EXPECT_EQ(response.SerializeAsString(), whole);
}

TEST(Envelope, NamesAMethodForEveryCall) {
  const auto& request = *pb::WebRequest::descriptor();
  int calls = 0;
  for (int i = 0; i < request.field_count(); ++i) {
    const auto& field = *request.field(i);
    if (field.number() < 16) {
      EXPECT_EQ(find_web_call(field.number()), nullptr) << field.name();
      continue;
    }
    const WebCall* call = find_web_call(field.number());
    ASSERT_NE(call, nullptr) << field.name();
    const auto* method = request.file()->pool()->FindMethodByName("heliograph.v1.RenderService." +
                                                                  call->method.substr(call->method.rfind('/') + 1));
    ASSERT_NE(method, nullptr) << call->method;
    EXPECT_EQ(method->input_type(), field.message_type());
    EXPECT_EQ(method->client_streaming(), call->many_requests);
    const auto* answer = pb::WebResponse::descriptor()->FindFieldByNumber(field.number());
    ASSERT_NE(answer, nullptr) << field.name();
    EXPECT_EQ(method->output_type(), answer->message_type());
    ++calls;
  }
  EXPECT_GE(calls, 12);
}

TEST(ProtocolTable, HasEveryFieldThatThePageMayMeet) {
  const auto table = nlohmann::json::parse(protocol_table());
  const auto& tile = table["messages"]["heliograph.v1.Tile"];
  ASSERT_EQ(int(tile.size()), pb::Tile::descriptor()->field_count());
  const nlohmann::json exr = {3, "exr", 12, 0, nullptr, nullptr};
  EXPECT_NE(std::find(tile.begin(), tile.end(), exr), tile.end());
  const auto& request = table["messages"]["heliograph.v1.WebRequest"];
  const nlohmann::json stream = {26, "stream_frames", 11, 0, "heliograph.v1.StreamRequest", "request"};
  EXPECT_NE(std::find(request.begin(), request.end(), stream), request.end());
  EXPECT_EQ(table["enums"]["heliograph.v1.Mode"]["MODE_COMBINED"], 4);
  // Fields that tell whether they are there.
  for (const auto& field : table["messages"]["heliograph.v1.MaterialEdit"]) {
    EXPECT_EQ(field[5].is_null(), field[1] != "roughness" && field[1] != "name" && field[1] != "index") << field;
  }
  // Whatever a field names is there.
  for (const auto& [name, fields] : table["messages"].items()) {
    for (const auto& field : fields) {
      if (field[4].is_null()) continue;
      EXPECT_TRUE(table["messages"].contains(field[4]) || table["enums"].contains(field[4])) << name << field;
    }
  }
}

TEST(AccessTokens, AreLinesOfAFile) {
  TemporaryFolder folder;
  const auto read = [&](const std::string& text) {
    write_file(folder / "tokens", text);
    return AccessTokens::read(folder / "tokens");
  };
  const auto two = read("# first\r\n0123456789abcdef \r\n\nfedcba9876543210");
  ASSERT_TRUE(two.ok());
  EXPECT_TRUE(two->allow("0123456789abcdef"));
  EXPECT_TRUE(two->allow_header("Bearer fedcba9876543210"));
  EXPECT_FALSE(two->allow("# first"));
  EXPECT_FALSE(two->allow(""));
  EXPECT_FALSE(two->allow_header("fedcba9876543210"));
  EXPECT_TRUE(AccessTokens().allow("anything"));
  for (const char* text : {"", "# only\n", "0123456789abcde", "0123456789 abcdef", "0123456789abcd\x80\x81"}) {
    const auto refused = read(text);
    ASSERT_FALSE(refused.ok()) << text;
    EXPECT_EQ(refused.error().where, "token-file");
    EXPECT_EQ(refused.error().message.find("0123456789"), std::string::npos) << "shows a token";
  }
  EXPECT_FALSE(read(std::string(257, 'a')).ok());
  EXPECT_TRUE(read(std::string(256, 'a')).ok());
  EXPECT_FALSE(AccessTokens::read(folder / "missing").ok());
  const auto random = AccessTokens::make_random(), again = AccessTokens::make_random();
  ASSERT_TRUE(random.ok() && again.ok());
  EXPECT_EQ(random->size(), 32u);
  EXPECT_NE(*random, *again);
}

}  // namespace
}  // namespace helio::test
