// Faults on purpose: a checker that cannot fail shows nothing. Never compiled; cppcheck.sh reads what is to be found.
#include <memory>
#include <utility>
#include <vector>

int beyond_the_end() {
  const int values[3] = {1, 2, 3};
  return values[3];  // finds: arrayIndexOutOfBounds
}

int through_nothing(const int* at) {
  if (!at) return *at;  // finds: nullPointerRedundantCheck
  return 0;
}

int never_set(bool sometimes) {
  int value;
  if (sometimes) value = 1;
  return value;  // finds: uninitvar
}

void take(std::vector<int> all);
int given_away(std::vector<int> mine) {
  take(std::move(mine));
  return mine[0];  // finds: accessMoved
}

const std::vector<int>& gone() {
  std::vector<int> local(3);
  return local;  // finds: returnReference
}

int by_zero(int x) {
  const int zero = 0;
  return x / zero;  // finds: zerodiv
}

bool twice_the_same(int x) {
  return x == 1 || x == 1;  // finds: duplicateExpression
}

// What stands in a lambda of a template must not go unread.
template <class Visit>
int in_a_template(Visit&& visit) {
  return visit([&]<class Number>(Number one) {
    const Number small[2] = {one, one};
    return small[2];  // finds: arrayIndexOutOfBounds
  });
}
