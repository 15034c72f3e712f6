#pragma once

#include <functional>
#include <nlohmann/json.hpp>

namespace ricochet {

/// Whether a scene still shows what it is kept for.
using SceneTest = std::function<bool(const nlohmann::ordered_json& scene)>;

/// A simpler scene that still passes the test, by greedy search: it takes the first of these changes that the test
/// allows, again and again until none is left or the time is over.
///
///   a contact or a friction element less; the friction of a contact less
///   a coordinate less: it stays where it starts, in every expression
///   a shorter end time
///   a parameter that is 0, 1, or has fewer digits
///
/// Parameters that no expression names any more are dropped. A scene that is not allowed (InputError) fails the test.
/// @param scene  with texts as expressions, as SceneDraw makes them; must pass
/// @param seconds  wall time
nlohmann::ordered_json minimise(nlohmann::ordered_json scene, const SceneTest& test, double seconds);

}  // namespace ricochet
