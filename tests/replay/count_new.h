// Linking this in replaces operator new by one that counts.
#ifndef GAPSCOPE_TESTS_REPLAY_COUNT_NEW_H_
#define GAPSCOPE_TESTS_REPLAY_COUNT_NEW_H_

namespace gapscope::testing {
long NewsSoFar();
}

#endif  // GAPSCOPE_TESTS_REPLAY_COUNT_NEW_H_
