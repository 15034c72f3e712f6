% Semi-implicit Euler steps with Newton's impact law, without friction: a method of its own process, in Octave.
%
%   ricochet run --problem bouncing_ball --method "external:octave-cli --no-gui examples/external/euler.m" --steps 1000
%
% The protocol is methods/external/README.md. A step of length h, with all contacts that touch:
%
%   M v+ = M v + h (f + Bu u) + J_n L_n,   q+ = q + h v+                             (1)
%   0 <= L_n  _|_  J_n' v+ + e J_n' v >= 0                                           (2)
1;

% A formula, or a nested list of them, as Octave writes them: q[0] is q(1), if(c, a, b) is choose(c, a, b).
function text = octave_text(formula)
  if isnumeric(formula)
    text = sprintf("%.17g", formula);
  else
    text = regexprep(strrep(formula, "**", "^"), '\<if\(', "choose(");
    text = regexprep(text, '([qv])\[(\d+)\]', '$1($2+1)');
  end
end

function x = choose(condition, a, b)
  if condition, x = a; else, x = b; end
end

function f = read_formulas(list, constants)
  list = cellstr_of(list);
  rows = cellfun(@(row) strjoin(cellfun(@octave_text, cellstr_of(row), "UniformOutput", false), ", "), list, ...
                 "UniformOutput", false);
  eval([constants "f = @(q, v, t) [" strjoin(rows, "; ") "];"]);
end

function list = cellstr_of(list)
  if ischar(list), list = {list}; elseif isnumeric(list), list = num2cell(list); end
  list = reshape(list, 1, []);
end

function scene = read_scene(document)
  problem = document.problem;
  constants = "";
  if isfield(problem, "params")
    for name = fieldnames(problem.params)'
      constants = sprintf("%s%s = %s; ", constants, name{1}, num2str(problem.params.(name{1})));
    end
  end
  scene.M = read_formulas(problem.M, constants);
  scene.f = read_formulas(problem.f, constants);
  scene.u = @(q, v, t) 0;
  scene.Bu = @(q, v, t) zeros(numel(problem.q0), 1);
  if isfield(problem, "u")
    scene.u = read_formulas(problem.u, constants);
    scene.Bu = read_formulas(problem.Bu, constants);
  end
  scene.contacts = {};
  if isfield(problem, "contacts")
    contacts = problem.contacts;
    if isstruct(contacts), contacts = num2cell(contacts); end
    for i = 1:numel(contacts)
      contact = contacts{i};
      e = "0";
      if isfield(contact, "e") && !isempty(contact.e), e = contact.e; end
      scene.contacts{i} = struct("gap", read_formulas(contact.gap, constants), ...
                                 "normal", read_formulas({contact.Jn}, constants), ...
                                 "e", read_formulas(e, constants)([], [], 0));
    end
  end
end

function answer = solve(scene, question)
  q = question.q0(:); v = question.v0(:); N = question.steps; h = question.T / N;
  n_c = numel(scene.contacts);
  begin = cputime();
  for k = 1:N
    t = (k - 1) * h;
    M = scene.M(q, v, t);
    v_free = v + h * (M \ (scene.f(q, v, t)(:) + scene.Bu(q, v, t) * scene.u(q, v, t)(:)));
    touching = find(cellfun(@(contact) contact.gap(q + 0.5 * h * v, v, t) <= 1e-13, scene.contacts));
    v_plus = v_free;
    if !isempty(touching)
      J = cell2mat(cellfun(@(contact) contact.normal(q, v, t), scene.contacts(touching)', "UniformOutput", false));
      e = cellfun(@(contact) contact.e, scene.contacts(touching)');
      W = M \ J'; G = J * W; L = zeros(numel(touching), 1);
      b = J * v_free + e .* min(0, J * v);
      for sweep = 1:10000  % projected Gauss-Seidel for (2)
        before = L;
        for i = 1:numel(L)
          L(i) = max(0, L(i) - (b(i) + G(i, :) * L) / G(i, i));
        end
        if norm(L - before, Inf) <= 1e-13 * norm(L, Inf), break; end
      end
      v_plus = v_free + W * L;
    end
    q += h * v_plus;
    v = v_plus;
  end
  answer = struct("status", "success", "t", question.T, "q", {num2cell(q')}, "v", {num2cell(v')}, ...
                  "seconds", cputime() - begin, "counters", struct("steps", N));
end

while true
  try
    line = input("", "s");  % fgetl(stdin) would wait for more than a line
  catch
    exit(0);  % nobody asks any more
  end
  question = jsondecode(line, "makeValidName", false);
  switch question.ask
    case "hello"
      answer = struct("ricochet", 1, "title", "semi-implicit Euler with Newton's law, in Octave", "order_smooth", 1, ...
                      "order_impacts", 1, "features", {{}});
    case "scene"
      scene = read_scene(question.scene);
      answer = struct("ok", true);
    case "solve"
      answer = solve(scene, question);
  end
  answer.id = question.id;
  puts([jsonencode(answer) "\n"]);
  fflush(stdout);
end
