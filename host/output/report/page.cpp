#include "host/output/report/page.hpp"

#include <array>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "host/output/report/assets.hpp"

namespace flexspline::report {
namespace {

// Fills {{NAME}}s in one pass, so that nothing in a part is taken for the name of another.
template <std::size_t N>
std::string filled(std::string_view text, const std::array<std::pair<std::string_view, std::string>, N>& parts) {
  std::string result;
  for (;;) {
    const std::size_t open = text.find("{{");
    result += text.substr(0, open);
    if (open == std::string_view::npos) return result;
    const std::size_t close = text.find("}}", open);
    if (close == std::string_view::npos) throw std::logic_error("the template of the report page has an open {{");
    const std::string_view name = text.substr(open + 2, close - open - 2);
    bool known = false;
    for (const auto& [key, value] : parts)
      if (key == name) {
        result += value;
        known = true;
      }
    if (!known) throw std::logic_error("the template of the report page asks for " + std::string(name));
    text.remove_prefix(close + 2);
  }
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      case '\'':
        result += "&#39;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string embedded(const nlohmann::json& document) {
  // Names come from the user's files and may be in any encoding.
  const std::string text = document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  std::string result;
  result.reserve(text.size());
  // These occur in strings of JSON alone, where an escape means the same.
  for (const char c : text) {
    if (c == '<')
      result += "\\u003c";
    else if (c == '>')
      result += "\\u003e";
    else if (c == '&')
      result += "\\u0026";
    else
      result += c;
  }
  return result;
}

std::string page(const nlohmann::json& document, Script script) {
  // As valid UTF-8 as the document that follows.
  const auto text = [&](const char* name) {
    const std::string quoted = document.at(name).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    return escaped(nlohmann::json::parse(quoted).get<std::string>());
  };
  const std::array<std::pair<std::string_view, std::string>, 8> parts{{
      {"TITLE", text("title")},
      {"VERDICT", text("verdict")},
      {"STYLE", std::string(kStyle)},
      {"SCRIPT", std::string(script == Script::report ? kScript : kClosedLoopScript)},
      {"UPLOT_STYLE", std::string(kUplotStyle)},
      {"UPLOT_SCRIPT", std::string(kUplotScript)},
      {"UPLOT_LICENCE", std::string(kUplotLicence)},
      {"DOCUMENT", embedded(document)},
  }};
  return filled(kTemplate, parts);
}

}  // namespace flexspline::report
