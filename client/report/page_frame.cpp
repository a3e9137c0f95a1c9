#include "client/report/page_frame.h"

#include <string_view>

#include "client/report/html_text.h"
#include "client/report/page_parts.h"
#include "renderer/codec/sha256.h"

namespace helio::report {
namespace {

// As a Content-Security-Policy names a script or style by its text.
std::string hash_source(std::string_view text) {
  Sha256 hash;
  hash.update(text);
  const Sha256Digest digest = hash.finish();
  return "'sha256-" + base64(digest) + "'";
}

}  // namespace

std::string page_frame(const std::string& title, const std::string& style, const std::string& before,
                       const std::string& body, const std::string& script) {
  const std::string all_style = std::string(page_style()) + style;
  const std::string script_source = script.empty() ? "" : "script-src " + hash_source(script) + "; ";
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src " +
      hash_source(all_style) + "; " + script_source +
      "base-uri 'none'; form-action 'none'\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
      escaped(title) + "</title>\n<style>" + all_style + "</style>\n</head>\n<body>\n" + before + "<main>\n" + body +
      "</main>\n";
  if (!script.empty()) html += "<script>" + script + "</script>\n";
  return html + "</body>\n</html>\n";
}

}  // namespace helio::report
