// Stands first in the page under test: whatever goes wrong from here on is noted.
const faults = [];
addEventListener("error", (event) => faults.push(String(event.message)));
addEventListener("unhandledrejection", (event) => faults.push(String(event.reason)));
addEventListener("securitypolicyviolation", (event) =>
  faults.push(`policy: ${event.violatedDirective} ${event.blockedURI}`),
);
for (const kind of ["error", "warn"]) {
  console[kind] = (...words) => faults.push(words.map(String).join(" "));
}
