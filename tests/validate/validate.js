// node validate.js FILE.glb …: fails where the Khronos validator finds an error; prints all it says.
const fs = require('fs');
const validator = require('gltf-validator');

(async () => {
  let errors = 0;
  for (const file of process.argv.slice(2)) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {maxIssues: 100});
    const {numErrors, numWarnings, numInfos, messages} = report.issues;
    console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos`);
    for (const m of messages) console.log(`  ${m.severity} ${m.code} ${m.pointer}: ${m.message}`);
    errors += numErrors;
  }
  process.exit(process.argv.length < 3 || errors > 0 ? 1 : 0);
})();
