// Shows GLB files to the validator of Khronos: node check.mjs a.glb b.glb ...
// Prints `error FILE: CODE POINTER MESSAGE` for every error, the same with `warning`, and `checked N` at the end.
import { readFileSync } from 'node:fs';
import validator from 'gltf-validator';

const files = process.argv.slice(2);
for (const file of files) {
  const { issues } = await validator.validateBytes(new Uint8Array(readFileSync(file)), {
    maxIssues: 100,
    externalResourceFunction: () => Promise.reject(new Error('nothing may lie outside')),
  });
  for (const { severity, code, pointer, message } of issues.messages.filter((issue) => issue.severity < 2)) {
    console.log(`${['error', 'warning'][severity]} ${file}: ${code} ${pointer} ${message}`);
  }
}
console.log(`checked ${files.length}`);
