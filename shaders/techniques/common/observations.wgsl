// Why a pass left a reservoir as it was; src/inspect.rs says it in words.
const REASON_NONE = 0u;
const REASON_NO_HISTORY = 1u;
const REASON_OFF_FILM = 2u;
const REASON_NO_SURFACE = 3u;
const REASON_OTHER_SURFACE = 4u;
const REASON_CONFIDENT = 5u;
const REASON_NO_NEIGHBOR = 6u;
const REASON_REJECTED = 7u;
