// A document as one HTML file that needs nothing else: no network, no other file.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace flexspline::report {

// Which sections a page has.
enum class Script { report, closed_loop };

// The page of a document (see document.hpp; of `closed_loop`, host/app/closed_loop/page.hpp). Whatever is in its texts,
// none of it becomes markup or script.
std::string page(const nlohmann::json& document, Script script = Script::report);

// Text as it may be written between tags and in attributes of HTML.
std::string escaped(std::string_view text);
// JSON as it may be written in a script element: no text in it can end the element or open a comment.
std::string embedded(const nlohmann::json& document);

}  // namespace flexspline::report
