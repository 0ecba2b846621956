/** The codes on the digit keys, in the order 1 to 9: main codes of EN 13508-2, labels ours. */
export const QUICK_CODES = [
  { code: 'BAB', label: 'Crack' },
  { code: 'BAC', label: 'Break' },
  { code: 'BAF', label: 'Surface' },
  { code: 'BAJ', label: 'Joint' },
  { code: 'BBA', label: 'Roots' },
  { code: 'BBB', label: 'Attached' },
  { code: 'BBC', label: 'Settled' },
  { code: 'BBF', label: 'Infiltration' },
  { code: 'BDD', label: 'Water' },
];
