// The cell of a list that says where to click.
#pragma once

#include <string>
#include <vector>

namespace surfseg::batch {

/// Where somebody has clicked, as words of `surfseg segment`.
struct ClicksCell {
  std::vector<std::string> words;    ///< --seed=, --outside=, --object=
  std::vector<std::string> objects;  ///< their names; none = one object without a name
  std::string file;                  ///< of landmarks in place of words
};

/// "12,-30,44; !20,-30,44": points apart by semicolons, outside ones with an exclamation mark;
/// "liver: 12,-30,44; kidney: 60,10,2" begins an object at each name. Anything else is the name of
/// a file of landmarks, all inside.
/// @throws surf::UsageError  a name that is no word of letters and digits
ClicksCell parse_clicks(const std::string& text);

/// The words of each point that follows the other, apart by semicolons: "1,2,3; 4,5,6".
std::vector<std::string> point_words(const std::string& option, const std::string& text);

/// Inside clicks as words: the points of a file as io::read_landmarks() reads it.
/// @param space  of plain points: "ras", "lps" or "ijk"; of what they are in afterwards: a file
///               that states its space gives "ras"
/// @throws surf::InputError  as io::read_landmarks(), or there is no point in space
std::vector<std::string> landmark_words(const std::string& path, std::string& space);

/// Parts of a text apart by semicolons, without blanks round them; empty ones are left out.
std::vector<std::string> parts_of(const std::string& text);

/// Letters and digits only: what BIDS calls a label.
bool is_label(const std::string& text);

}  // namespace surfseg::batch
